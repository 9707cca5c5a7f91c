// USD as text (.usda): "Universal Scene Description", openusd.org. Lengths are in metres, Y is up, and time
// codes are frames.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>

#include "producer/base/to_float.h"
#include "producer/base/version.h"
#include "producer/build/lights.h"
#include "producer/export/export_notes.h"
#include "producer/export/film_export.h"
#include "producer/export/sample_track.h"
#include "producer/export/spool.h"
#include "producer/export/usd_looks.h"
#include "producer/export/usd_text.h"
#include "render/output_file.h"
#include "sim/core/rotation.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;
using Eigen::Affine3f;
using Eigen::Quaternionf;
using Eigen::Vector3f;

/// Returns the text of an attribute: "name.timeSamples = { 1: a, 2: b, }", or "name = a" for a constant
/// value.
template <class T>
std::string sampled(std::string_view attribute, const SampleTrack<T>& track) {
  if (track.samples().empty()) return {};
  if (track.constant()) return fmt::format("{} = {}\n", attribute, usd::text(track.samples()[0].second));
  std::string out = fmt::format("{}.timeSamples = {{\n", attribute);
  for (const auto& [frame, value] : track.samples())
    out += fmt::format("  {}: {},\n", frame, usd::text(value));
  return out + "}\n";
}

/// An attribute that is an array of numbers at each frame.
class SpooledAttribute {
 public:
  /// Begins an attribute. `interpolation`: how USD assigns the values to the points; empty: the default of
  /// the attribute.
  SpooledAttribute(std::string declaration, const fs::path& folder, std::string interpolation = {})
      : declaration_(std::move(declaration)), interpolation_(std::move(interpolation)), spool_(folder) {}
  void add(int frame, const std::string& value) { spool_.append(fmt::format("  {}: {},\n", frame, value)); }
  void write(render::OutputFile& file) {
    const auto put = [&](const std::string& text) {
      file.write({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
    };
    if (spool_.size() == 0) return;
    if (!interpolation_.empty())
      put(fmt::format("{} (\n  interpolation = \"{}\"\n)\n", declaration_, interpolation_));
    put(declaration_ + ".timeSamples = {\n");
    spool_.copy_to(file);
    put("}\n");
  }

 private:
  std::string declaration_, interpolation_;
  Spool spool_;
};

struct PoseTrack {
  SampleTrack<Vector3f> position;
  SampleTrack<Quaternionf> orientation;
  SampleTrack<std::string> visibility;  // empty for bodies that exist during the whole film

  void add(int frame, const Vector3f& p, Quaternionf q) {
    // q and -q are the same rotation, but an interpolation between opposite signs would take the long way
    // around.
    if (!orientation.samples().empty() && orientation.samples().back().second.dot(q) < 0) q.coeffs() *= -1;
    position.add(frame, p);
    orientation.add(frame, q);
  }
  std::string text() const {
    return sampled("quatf xformOp:orient", orientation) + sampled("double3 xformOp:translate", position) +
           sampled("token visibility", visibility) +
           "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]\n";
  }
};

struct ClothAttributes {
  explicit ClothAttributes(const fs::path& folder)
      : points("point3f[] points", folder),
        normals("normal3f[] normals", folder, "vertex"),
        velocities("vector3f[] velocities", folder),
        counts("int[] faceVertexCounts", folder),
        indices("int[] faceVertexIndices", folder),
        uvs("texCoord2f[] primvars:st", folder, "vertex") {}
  SpooledAttribute points, normals, velocities, counts, indices, uvs;
  std::optional<uint32_t> version;      // version of the triangles that were written last
  SampleTrack<std::string> visibility;  // empty for cloths that exist during the whole film
};

struct PointAttributes {
  explicit PointAttributes(const fs::path& folder)
      : points("point3f[] points", folder),
        velocities("vector3f[] velocities", folder),
        widths("float[] widths", folder, "vertex"),
        ids("int64[] ids", folder),
        colors("color3f[] primvars:displayColor", folder, "vertex"),
        opacities("float[] primvars:displayOpacity", folder, "vertex") {}
  SpooledAttribute points, velocities, widths, ids, colors, opacities;
};

struct RodTracks {
  SampleTrack<Eigen::Matrix4f> transform;
  SampleTrack<std::string> visibility;  // a broken rod is invisible
};

struct LampTracks {
  SampleTrack<Eigen::Matrix4f> transform;
  SampleTrack<float> intensity;
  SampleTrack<Vector3f> color;
  render::Lamp first;
};

/// Returns the transform of a camera or light at `from`. In its own frame, it looks along -Z.
Eigen::Matrix4f looking(const Vector3f& from, const Vector3f& direction, const Vector3f& up) {
  const Vector3f z = -direction.normalized();
  Vector3f x = up.cross(z);
  if (x.norm() < 1e-6f) x = Vector3f::UnitX().cross(z).norm() > 1e-3f ? Vector3f::UnitX() : Vector3f::UnitZ();
  x = (x - x.dot(z) * z).normalized();
  Affine3f transform = Affine3f::Identity();
  transform.linear().col(0) = x;
  transform.linear().col(1) = z.cross(x);
  transform.linear().col(2) = z;
  transform.translation() = from;
  return transform.matrix();
}

void note_visibility(int frame, const Lifetime& lifetime, double time, SampleTrack<std::string>& visibility) {
  if (lifetime.is_limited()) visibility.add(frame, lifetime.contains(time) ? "inherited" : "invisible");
}

class UsdExport : public FilmExport {
 public:
  UsdExport(const fs::path& file, const FilmParts& parts)
      : parts_(parts),
        folder_(file.parent_path()),
        file_(file),
        looks_(parts, folder_, file.stem().string()),
        bodies_(parts.bodies.size()),
        rods_(parts.rods.size()),
        lamps_(parts.lamps.size()) {
    for (std::size_t i = 0; i < parts.cloths.size(); ++i)
      cloths_.push_back(std::make_unique<ClothAttributes>(folder_));
    for (std::size_t i = 0; i < parts.points.size(); ++i)
      points_.push_back(std::make_unique<PointAttributes>(folder_));
  }

  void write(const Snapshot& snapshot) override {
    const int frame = snapshot.frame;
    if (first_ == 0) first_ = frame;
    last_ = frame;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const FilmBody& body = parts_.bodies[i];
      const BodySample& s = body.slot ? snapshot.bodies[*body.slot] : body.place;
      bodies_[i].add(frame, s.position, s.orientation);
      note_visibility(frame, body.lifetime, snapshot.time, bodies_[i].visibility);
    }
    for (std::size_t i = 0; i < rods_.size(); ++i) {
      const auto place = rod_transform(snapshot.rods[parts_.rods[i].rod]);
      rods_[i].visibility.add(frame, place ? "inherited" : "invisible");
      if (place) rods_[i].transform.add(frame, place->matrix());
    }
    for (std::size_t i = 0; i < cloths_.size(); ++i) {
      const FilmCloth& cloth = parts_.cloths[i];
      write_cloth(frame, cloth, snapshot.cloths[cloth.cloth], *cloths_[i]);
      note_visibility(frame, cloth.lifetime, snapshot.time, cloths_[i]->visibility);
    }
    for (std::size_t i = 0; i < points_.size(); ++i)
      write_points(frame, snapshot.point_sets[parts_.points[i].set], *points_[i]);
    write_camera(frame, parts_.camera_at(snapshot));
    const std::vector<render::Lamp> lamps = parts_.lamps_at(snapshot);
    for (std::size_t i = 0; i < lamps_.size(); ++i) write_lamp(frame, lamps[i], lamps_[i]);
  }

  void close() override {
    put_header();
    put("def Xform \"World\"\n{\n");
    put(looks_.write());
    put_bodies();
    put_rods();
    for (std::size_t i = 0; i < cloths_.size(); ++i) put_cloth(parts_.cloths[i], *cloths_[i]);
    for (std::size_t i = 0; i < points_.size(); ++i) put_points(parts_.points[i], *points_[i]);
    put_camera();
    put_lights();
    put("}\n\n");
    put_prototypes();
    file_.commit();
  }

  std::vector<std::string> notes() const override {
    using enum LookFeature;
    std::vector<std::string> notes = export_notes(
        parts_, "UsdPreviewSurface", {texture, glow_texture, normal_map, surface_map, mask, lacquer, surface},
        {FilmFeature::sky, FilmFeature::camera, FilmFeature::lens});
    if (!std::ranges::all_of(parts_.points, &FilmPoints::are_balls))
      notes.push_back("USD has no smoke, streaks and pictures: all particles are exported as points");
    return notes;
  }

 private:
  void put(const std::string& text) {
    file_.write({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  }

  void write_cloth(int frame, const FilmCloth& cloth, const ClothSample& sample, ClothAttributes& out) {
    using std::span;
    const ClothSurface surface = cloth_surface(cloth, sample);
    if (out.version != sample.version) {
      out.version = sample.version;
      const std::vector<int> counts(surface.triangles->size() / 3, 3);
      out.counts.add(frame, usd::list(span<const int>(counts)));
      out.indices.add(frame, usd::list(span<const uint32_t>(*surface.triangles)));
      out.uvs.add(frame, usd::list(span<const Eigen::Vector2f>(surface.uvs)));
    }
    out.points.add(frame, usd::list(span<const Vector3f>(sample.points)));
    out.normals.add(frame, usd::list(span<const Vector3f>(surface.normals)));
    out.velocities.add(frame, usd::list(span<const Vector3f>(sample.velocities)));
  }

  void write_points(int frame, const PointSet& set, PointAttributes& out) {
    std::string points = "[", velocities = "[", widths = "[", ids = "[", colors = "[", opacities = "[";
    for (const render::Point& p : set.points) {
      const char* comma = points.size() > 1 ? ", " : "";
      points += comma + usd::text(p.position);
      velocities += comma + usd::text(p.velocity);
      widths += comma + usd::text(2 * p.radius);
      ids += comma + std::to_string(p.id);
      colors += comma + usd::text(Vector3f(p.color.head<3>()));
      opacities += comma + usd::text(p.color.w());
    }
    out.points.add(frame, points + "]");
    out.velocities.add(frame, velocities + "]");
    out.widths.add(frame, widths + "]");
    out.ids.add(frame, ids + "]");
    out.colors.add(frame, colors + "]");
    out.opacities.add(frame, opacities + "]");
  }

  // USD gives apertures and focal lengths in tenths of the scene unit, which is the metre here: the frame is
  // 24 mm high.
  static constexpr float kApertureHeight = 0.24f;

  void write_camera(int frame, const render::Camera& camera) {
    camera_.add(frame, looking(camera.eye, camera.target - camera.eye, camera.up));
    const float focal = kApertureHeight / 2 / std::tan(camera.fov_deg / 2 * std::numbers::pi_v<float> / 180);
    focal_.add(frame, focal);
    focus_.add(frame, camera.focus > 0 ? camera.focus : (camera.target - camera.eye).norm());
    f_stop_.add(frame, camera.aperture > 0 ? focal / 10 / camera.aperture : 0);
  }

  void write_lamp(int frame, const render::Lamp& lamp, LampTracks& out) {
    if (out.intensity.samples().empty()) out.first = lamp;
    out.transform.add(frame, looking(lamp.position, lamp.direction, Vector3f::UnitY()));
    const float brightness = lamp.intensity.maxCoeff();
    out.color.add(frame, brightness > 0 ? Vector3f(lamp.intensity / brightness) : Vector3f(Vector3f::Ones()));
    // A white surface 1 m away has the radiance L if the light causes an irradiance of pi L. Normalized
    // lights of USD distribute their intensity over their area: 4 pi r^2 for a sphere, of which pi r^2 is
    // visible.
    const float pi = std::numbers::pi_v<float>;
    out.intensity.add(frame, (lamp.size.isZero(0) ? 4 : 1) * pi * brightness);
  }

  void put_header() {
    put(
        fmt::format("#usda 1.0\n(\n  defaultPrim = \"World\"\n  doc = {}\n  endTimeCode = {}\n"
                    "  framesPerSecond = {}\n  metersPerUnit = 1\n  startTimeCode = {}\n"
                    "  timeCodesPerSecond = {}\n  upAxis = \"Y\"\n)\n\n",
                    usd::quoted(parts_.scene.name + ", by offstage " + std::string(version())), last_,
                    parts_.scene.output.fps.per_second(), first_, parts_.scene.output.fps.per_second()));
  }

  static std::string display_name(const std::string& name) {
    return fmt::format("displayName = {}", usd::quoted(name));
  }

  void put_bodies() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const FilmBody& body = parts_.bodies[i];
      put(fmt::format("def Xform \"{}\" (\n  {}\n)\n{{\n{}", names_(body.name), display_name(body.name),
                      bodies_[i].text()));
      for (std::size_t k = 0; k < body.parts.size(); ++k) {
        const FilmPart& part = body.parts[k];
        put(
            fmt::format("def \"part_{}\" (\n  prepend references = </_Meshes/mesh_{}>\n"
                        "  prepend apiSchemas = [\"MaterialBindingAPI\"]\n)\n{{\n"
                        "rel material:binding = <{}>\n",
                        k, part.mesh, looks_.path(part.material)));
        if (parts_.materials[part.material].look.two_sided) put("uniform bool doubleSided = 1\n");
        if (!part.body_from_part.matrix().isIdentity(0))
          put(
              fmt::format("matrix4d xformOp:transform = {}\n"
                          "uniform token[] xformOpOrder = [\"xformOp:transform\"]\n",
                          usd::text(Eigen::Matrix4f(part.body_from_part.matrix()))));
        put("}\n");
      }
      put("}\n");
    }
  }

  void put_rods() {
    for (std::size_t i = 0; i < rods_.size(); ++i) {
      const FilmRod& rod = parts_.rods[i];
      put(
          fmt::format("def \"{}\" (\n  {}\n  prepend references = </_Meshes/mesh_{}>\n"
                      "  prepend apiSchemas = [\"MaterialBindingAPI\"]\n)\n{{\n"
                      "rel material:binding = <{}>\n{}"
                      "uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}}\n",
                      names_(rod.name), display_name(rod.name), rod.mesh, looks_.path(rod.material),
                      sampled("matrix4d xformOp:transform", rods_[i].transform) +
                          sampled("token visibility", rods_[i].visibility)));
    }
  }

  void put_cloth(const FilmCloth& cloth, ClothAttributes& a) {
    put(
        fmt::format("def Mesh \"{}\" (\n  {}\n  prepend apiSchemas = [\"MaterialBindingAPI\"]\n)\n{{\n"
                    "rel material:binding = <{}>\nuniform token subdivisionScheme = \"none\"\n"
                    "uniform bool doubleSided = 1\n",
                    names_(cloth.name), display_name(cloth.name), looks_.path(cloth.material)));
    for (SpooledAttribute* attribute : {&a.counts, &a.indices, &a.points, &a.velocities, &a.normals, &a.uvs})
      attribute->write(file_);
    put(sampled("token visibility", a.visibility) + "}\n");
  }

  void put_points(const FilmPoints& set, PointAttributes& a) {
    put(fmt::format("def Points \"{}\" (\n  {}\n)\n{{\n", names_(set.name), display_name(set.name)));
    for (SpooledAttribute* attribute : {&a.points, &a.velocities, &a.widths, &a.ids, &a.colors, &a.opacities})
      attribute->write(file_);
    put("}\n");
  }

  void put_camera() {
    const Eigen::Vector2i size = parts_.scene.render.size;
    put(fmt::format(
        "def Camera \"{}\"\n{{\ntoken projection = \"perspective\"\n"
        "float horizontalAperture = {}\nfloat verticalAperture = {}\n"
        "float2 clippingRange = (0.05, 1000000)\n",
        names_("Camera"), kApertureHeight * static_cast<float>(size.x()) / static_cast<float>(size.y()),
        kApertureHeight));
    put(sampled("float focalLength", focal_) + sampled("float focusDistance", focus_) +
        sampled("float fStop", f_stop_) + sampled("matrix4d xformOp:transform", camera_) +
        "uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}\n");
  }

  void put_lights() {
    const render::Sun& sun = parts_.sun;
    if (sun.intensity > 0)
      put(fmt::format(
          "def DistantLight \"{}\"\n{{\nfloat inputs:angle = {}\nfloat inputs:intensity = {}\n"
          "bool inputs:normalize = 1\ncolor3f inputs:color = {}\n"
          "matrix4d xformOp:transform = {}\n"
          "uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}}\n",
          names_("Sun"), sun.size_deg, std::numbers::pi_v<float> * sun.intensity, usd::text(sun.color),
          usd::text(looking(Vector3f::Zero(), -sun.direction, Vector3f::UnitY()))));
    const render::Environment sky = environment_of(parts_.scene);
    if (sky.intensity > 0)
      put(fmt::format(
          "def DomeLight \"{}\"\n{{\nfloat inputs:intensity = {}\ncolor3f inputs:color = {}\n}}\n",
          names_("Sky"), sky.intensity, usd::text(Vector3f(0.5f * (sky.zenith + sky.horizon)))));
    for (std::size_t i = 0; i < lamps_.size(); ++i) {
      const LampTracks& lamp = lamps_[i];
      const bool rectangle = !lamp.first.size.isZero(0);
      put(fmt::format("def {} \"{}\"", rectangle ? "RectLight" : "SphereLight", names_(parts_.lamps[i])));
      if (lamp.first.cone_deg > 0) put(" (\n  prepend apiSchemas = [\"ShapingAPI\"]\n)");
      put("\n{\nbool inputs:normalize = 1\n");
      if (rectangle)
        put(fmt::format("float inputs:width = {}\nfloat inputs:height = {}\n", lamp.first.size.x(),
                        lamp.first.size.y()));
      else
        put(fmt::format("float inputs:radius = {}\n", lamp.first.radius));
      if (lamp.first.cone_deg > 0)
        put(fmt::format("float inputs:shaping:cone:angle = {}\nfloat inputs:shaping:cone:softness = {}\n",
                        lamp.first.cone_deg / 2, lamp.first.softness));
      put(sampled("float inputs:intensity", lamp.intensity) + sampled("color3f inputs:color", lamp.color) +
          sampled("matrix4d xformOp:transform", lamp.transform) +
          "uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}\n");
    }
  }

  void put_coordinates(const char* name, const std::vector<Eigen::Vector2f>& uvs) {
    if (uvs.empty()) return;
    std::vector<Eigen::Vector2f> upwards;
    for (const Eigen::Vector2f& uv : uvs) upwards.push_back({uv.x(), 1 - uv.y()});
    put(fmt::format("texCoord2f[] primvars:{} = {} (\n  interpolation = \"vertex\"\n)\n", name,
                    usd::list(std::span<const Eigen::Vector2f>(upwards))));
  }

  /// The meshes that bodies refer to. A class prim is not drawn by itself.
  void put_prototypes() {
    put("class \"_Meshes\"\n{\n");
    for (std::size_t i = 0; i < parts_.meshes.size(); ++i) {
      const render::Mesh& mesh = parts_.meshes[i];
      const std::vector<int> counts(mesh.indices.size() / 3, 3);
      put(fmt::format(
          "def Mesh \"mesh_{}\"\n{{\nuniform token subdivisionScheme = \"none\"\n"
          "int[] faceVertexCounts = {}\nint[] faceVertexIndices = {}\npoint3f[] points = {}\n",
          i, usd::list(std::span<const int>(counts)), usd::list(std::span<const uint32_t>(mesh.indices)),
          usd::list(std::span<const Vector3f>(mesh.positions))));
      if (!mesh.normals.empty())
        put(fmt::format("normal3f[] normals = {} (\n  interpolation = \"vertex\"\n)\n",
                        usd::list(std::span<const Vector3f>(mesh.normals))));
      put_coordinates("st", mesh.uvs);
      put_coordinates("st1", mesh.second_uvs);
      put("}\n");
    }
    put("}\n");
  }

  const FilmParts& parts_;
  fs::path folder_;
  render::OutputFile file_;
  UsdLooks looks_;
  int first_ = 0, last_ = 0;
  std::vector<PoseTrack> bodies_;
  std::vector<RodTracks> rods_;
  std::vector<std::unique_ptr<ClothAttributes>> cloths_;
  std::vector<std::unique_ptr<PointAttributes>> points_;
  SampleTrack<Eigen::Matrix4f> camera_;
  SampleTrack<float> focal_, focus_, f_stop_;
  std::vector<LampTracks> lamps_;
  usd::PrimNames names_;
};

}  // namespace

std::unique_ptr<FilmExport> make_usd_export(const fs::path& file, const FilmParts& parts) {
  return std::make_unique<UsdExport>(file, parts);
}

}  // namespace offstage::producer
