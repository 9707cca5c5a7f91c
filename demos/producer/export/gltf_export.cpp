// glTF 2.0 as one binary file (.glb): Khronos Group, "glTF 2.0 Specification". Bodies are animated nodes, and
// cloths are meshes with a morph target for each frame.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/to_float.h"
#include "producer/base/version.h"
#include "producer/build/lights.h"
#include "producer/export/export_notes.h"
#include "producer/export/film_export.h"
#include "producer/export/gltf_buffer.h"
#include "producer/export/gltf_looks.h"
#include "producer/export/sample_track.h"
#include "render/output_file.h"
#include "sim/core/rotation.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;
using Eigen::Affine3f;
using Eigen::Quaternionf;
using Eigen::Vector3f;
using Json = nlohmann::ordered_json;

// Constants of the format.
constexpr uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

/// A range of frames in which a cloth has the same triangles. In the file it is a mesh with a morph target
/// for each frame after the first.
struct ClothStretch {
  std::vector<int> frames;
  std::vector<uint32_t> triangles;
  std::vector<Eigen::Vector2f> uvs;
  std::vector<Vector3f> points, normals;  // at the first frame of the range
  // Accessors of the positions and normals, for each frame after the first.
  std::vector<std::pair<int, int>> targets;
};

struct ClothRecord {
  std::optional<uint32_t> version;
  std::vector<ClothStretch> stretches;
};

struct NodeTracks {
  SampleTrack<Vector3f> translation, scale;
  SampleTrack<Quaternionf> rotation;

  void add(int frame, const Vector3f& position, Quaternionf q) {
    if (!rotation.samples().empty() && rotation.samples().back().second.dot(q) < 0) q.coeffs() *= -1;
    translation.add(frame, position);
    rotation.add(frame, q);
  }
};

Json array(const Vector3f& v) {
  return {v.x(), v.y(), v.z()};
}
Json array(const Quaternionf& q) {
  return {q.x(), q.y(), q.z(), q.w()};  // the order of glTF
}
void append(const Vector3f& v, std::vector<float>& out) {
  out.insert(out.end(), v.data(), v.data() + 3);
}
void append(const Quaternionf& q, std::vector<float>& out) {
  out.insert(out.end(), q.coeffs().data(), q.coeffs().data() + 4);  // x, y, z, w
}

/// Returns a rotation that turns -Z to `direction`, and +Y towards `up`. In glTF, cameras and lights look
/// along -Z.
Quaternionf look_rotation(const Vector3f& direction, const Vector3f& up) {
  const Vector3f z = -direction.normalized();
  Vector3f x = up.cross(z);
  if (x.norm() < 1e-6f) return sim::rotation_between(Vector3f(-Vector3f::UnitZ()), direction);
  x.normalize();
  Eigen::Matrix3f m;
  m << x, z.cross(x), z;
  return Quaternionf(m).normalized();
}

class GltfExport : public FilmExport {
 public:
  GltfExport(const fs::path& file, const FilmParts& parts)
      : parts_(parts),
        file_(file),
        buffer_(file),
        looks_(parts, buffer_),
        bodies_(parts.bodies.size()),
        rods_(parts.rods.size()),
        cloths_(parts.cloths.size()),
        lamps_(parts.lamps.size()) {}

  void write(const Snapshot& snapshot) override {
    const int frame = snapshot.frame;
    frames_.push_back(frame);
    times_.push_back(snapshot.time);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const FilmBody& body = parts_.bodies[i];
      const BodySample& s = body.slot ? snapshot.bodies[*body.slot] : body.place;
      bodies_[i].add(frame, s.position, s.orientation);
      if (body.lifetime.is_limited())
        bodies_[i].scale.add(frame,
                             body.lifetime.contains(snapshot.time) ? Vector3f::Ones() : Vector3f::Zero());
    }
    for (std::size_t i = 0; i < rods_.size(); ++i)
      write_rod(frame, snapshot.rods[parts_.rods[i].rod], rods_[i]);
    for (std::size_t i = 0; i < cloths_.size(); ++i)
      write_cloth(frame, parts_.cloths[i], snapshot.cloths[parts_.cloths[i].cloth], cloths_[i]);
    const render::Camera camera = parts_.camera_at(snapshot);
    camera_.add(frame, camera.eye, look_rotation(camera.target - camera.eye, camera.up));
    if (frames_.size() == 1) first_fov_deg_ = camera.fov_deg;
    zooms_ = zooms_ || camera.fov_deg != first_fov_deg_;
    const std::vector<render::Lamp> lamps = parts_.lamps_at(snapshot);
    for (std::size_t i = 0; i < lamps_.size(); ++i) {
      lamps_[i].add(frame, lamps[i].position, look_rotation(lamps[i].direction, Vector3f::UnitY()));
      if (frames_.size() == 1) first_lamps_.push_back(lamps[i]);
      flickers_ = flickers_ || lamps[i].intensity != first_lamps_[i].intensity;
    }
  }

  void close() override {
    looks_.write();
    for (const FilmCloth& cloth : parts_.cloths) looks_.materials[cloth.material]["doubleSided"] = true;
    add_meshes();
    for (std::size_t i = 0; i < bodies_.size(); ++i) add_body(parts_.bodies[i], bodies_[i]);
    for (std::size_t i = 0; i < rods_.size(); ++i)
      add_node({{"name", parts_.rods[i].name},
                {"mesh", mesh_of_part(parts_.rods[i].mesh, parts_.rods[i].material)}},
               rods_[i]);
    for (std::size_t i = 0; i < cloths_.size(); ++i) add_cloth(parts_.cloths[i], cloths_[i]);
    add_camera();
    add_lights();
    write_file();
  }

  std::vector<std::string> notes() const override {
    using enum LookFeature;
    std::vector<std::string> notes =
        export_notes(parts_, "glTF",
                     {texture, glow_texture, normal_map, surface_map, specular_map, vertex_colors, mask,
                      glass, lacquer, sheen, surface},
                     {FilmFeature::camera});
    if (!parts_.points.empty())
      notes.push_back(fmt::format(
          "glTF cannot store particles: {} particle system{} not exported; use .usda, .ply or .csv",
          parts_.points.size(), parts_.points.size() == 1 ? " is" : "s are"));
    const auto areas =
        std::ranges::count_if(first_lamps_, [](const render::Lamp& lamp) { return !lamp.size.isZero(0); });
    if (areas > 0)
      notes.push_back(fmt::format("glTF has no area lights: {} {} exported as spot lights", areas,
                                  areas == 1 ? "is" : "are"));
    if (zooms_)
      notes.push_back(
          "glTF has no animated field of view: the camera keeps the field of view of its first frame");
    if (flickers_)
      notes.push_back("glTF has no animated intensity: lights keep the intensity of the first frame");
    return notes;
  }

 private:
  void write_rod(int frame, const RodSample& rod, NodeTracks& out) {
    const Vector3f d = rod.b - rod.a;
    if (!rod_transform(rod)) {  // the rod does not exist any more
      out.scale.add(frame, Vector3f::Zero());
      return;
    }
    out.add(frame, 0.5f * (rod.a + rod.b), sim::rotation_between(Vector3f::UnitY(), d));
    out.scale.add(frame, {1, d.norm(), 1});
  }

  void write_cloth(int frame, const FilmCloth& cloth, const ClothSample& sample, ClothRecord& out) {
    ClothSurface surface = cloth_surface(cloth, sample);
    if (out.version != sample.version) {
      out.version = sample.version;
      out.stretches.push_back({{frame}, *surface.triangles, {}, sample.points, surface.normals, {}});
      for (const Eigen::Vector2f& uv : surface.uvs) out.stretches.back().uvs.push_back({uv.x(), 1 - uv.y()});
      return;
    }
    ClothStretch& stretch = out.stretches.back();
    stretch.frames.push_back(frame);
    std::vector<Vector3f> moves(sample.points.size());
    for (std::size_t i = 0; i < moves.size(); ++i) moves[i] = sample.points[i] - stretch.points[i];
    const int positions = buffer_.add(moves, kGltfVertices, true);
    for (std::size_t i = 0; i < moves.size(); ++i) moves[i] = surface.normals[i] - stretch.normals[i];
    stretch.targets.emplace_back(positions, buffer_.add(moves, kGltfVertices));
  }

  float time_of(int frame) const {
    return to_float(parts_.scene.output.fps.seconds(frame - frames_.front()));
  }

  template <class T>
  void animate(const SampleTrack<T>& track, int node, const char* path,
               const char* interpolation = "LINEAR") {
    if (track.samples().size() < 2) return;
    std::vector<float> times, values;
    for (const auto& [frame, value] : track.samples()) {
      times.push_back(time_of(frame));
      append(value, values);
    }
    add_channel(times, values, std::is_same_v<T, Quaternionf> ? 4 : 3, node, path, interpolation);
  }
  void add_channel(std::span<const float> times, std::span<const float> values, int width, int node,
                   const char* path, const char* interpolation) {
    samplers_.push_back({{"input", buffer_.add(times, 1, 0, true)},
                         {"interpolation", interpolation},
                         {"output", buffer_.add(values, width)}});
    channels_.push_back({{"sampler", samplers_.size() - 1}, {"target", {{"node", node}, {"path", path}}}});
  }

  int add_node(Json node, const NodeTracks& tracks, bool root = true) {
    if (!tracks.translation.samples().empty()) {
      node["translation"] = array(tracks.translation.samples()[0].second);
      node["rotation"] = array(tracks.rotation.samples()[0].second);
    }
    if (!tracks.scale.samples().empty()) node["scale"] = array(tracks.scale.samples()[0].second);
    nodes_.push_back(std::move(node));
    const int index = static_cast<int>(nodes_.size()) - 1;
    animate(tracks.translation, index, "translation");
    animate(tracks.rotation, index, "rotation");
    animate(tracks.scale, index, "scale");
    if (root) roots_.push_back(index);
    return index;
  }

  void add_meshes() {
    const auto add = [&](const auto& vectors) {
      constexpr int kWidth = std::remove_cvref_t<decltype(vectors[0])>::SizeAtCompileTime;
      return buffer_.add({vectors[0].data(), kWidth * vectors.size()}, kWidth, kGltfVertices);
    };
    for (const render::Mesh& mesh : parts_.meshes) {
      Json attributes = {{"POSITION", buffer_.add(mesh.positions, kGltfVertices, true)}};
      if (!mesh.normals.empty()) attributes["NORMAL"] = add(mesh.normals);
      if (!mesh.tangents.empty()) attributes["TANGENT"] = add(mesh.tangents);
      if (!mesh.uvs.empty()) attributes["TEXCOORD_0"] = add(mesh.uvs);
      if (!mesh.second_uvs.empty()) attributes["TEXCOORD_1"] = add(mesh.second_uvs);
      if (!mesh.colors.empty()) attributes["COLOR_0"] = add(mesh.colors);
      primitives_.push_back(
          {{"attributes", std::move(attributes)}, {"indices", buffer_.add_indices(mesh.indices)}});
    }
  }

  /// Returns the glTF mesh for geometry with a material.
  int mesh_of_part(std::size_t mesh, std::size_t material) {
    const auto [it, is_new] = meshes_done_.try_emplace({mesh, material}, static_cast<int>(meshes_.size()));
    if (is_new) {
      Json primitive = primitives_[mesh];
      primitive["material"] = material;
      // In glTF, the colours of a mesh multiply those of every material.
      if (!parts_.materials[material].look.vertex_colors) primitive["attributes"].erase("COLOR_0");
      meshes_.push_back({{"primitives", Json::array({std::move(primitive)})}});
    }
    return it->second;
  }

  void add_body(const FilmBody& body, const NodeTracks& tracks) {
    Json node = {{"name", body.name}};
    Json children = Json::array();
    for (const FilmPart& part : body.parts) {
      const int mesh = mesh_of_part(part.mesh, part.material);
      if (body.parts.size() == 1 && part.body_from_part.matrix().isIdentity(0)) {
        node["mesh"] = mesh;
        break;
      }
      Json matrix = Json::array();
      // Eigen and glTF both store matrices by columns.
      for (int i = 0; i < 16; ++i) matrix.push_back(part.body_from_part.data()[i]);
      nodes_.push_back({{"mesh", mesh}, {"matrix", std::move(matrix)}});
      children.push_back(nodes_.size() - 1);
    }
    if (!children.empty()) node["children"] = std::move(children);
    add_node(std::move(node), tracks);
  }

  void add_cloth(const FilmCloth& cloth, const ClothRecord& record) {
    for (std::size_t i = 0; i < record.stretches.size(); ++i) {
      const ClothStretch& stretch = record.stretches[i];
      const Json attributes = {
          {"POSITION", buffer_.add(stretch.points, kGltfVertices, true)},
          {"NORMAL", buffer_.add(stretch.normals, kGltfVertices)},
          {"TEXCOORD_0", buffer_.add({stretch.uvs[0].data(), 2 * stretch.uvs.size()}, 2, kGltfVertices)}};
      Json primitive = {{"attributes", attributes},
                        {"indices", buffer_.add_indices(stretch.triangles)},
                        {"material", cloth.material}};
      for (const auto& [position, normal] : stretch.targets)
        primitive["targets"].push_back({{"POSITION", position}, {"NORMAL", normal}});
      Json mesh = {{"primitives", Json::array({std::move(primitive)})}};
      const std::size_t targets = stretch.targets.size();
      if (targets > 0) mesh["weights"] = std::vector<float>(targets, 0);
      meshes_.push_back(std::move(mesh));
      const bool comes_or_goes = record.stretches.size() > 1 || cloth.lifetime.is_limited();
      const SampleTrack<Vector3f> presence = presence_of(cloth, record, i);
      NodeTracks tracks;
      if (comes_or_goes) tracks.scale.add(frames_.front(), presence.samples()[0].second);
      const int node = add_node({{"name", i == 0 ? cloth.name : fmt::format("{}/torn_{}", cloth.name, i)},
                                 {"mesh", meshes_.size() - 1}},
                                tracks);
      if (targets > 0) animate_weights(stretch, node);
      if (comes_or_goes) animate(presence, node, "scale", "STEP");
    }
  }

  /// Animates the weights of the morph targets. At each frame, one target has the weight 1. Between frames,
  /// the cloth is interpolated linearly.
  void animate_weights(const ClothStretch& stretch, int node) {
    const std::size_t targets = stretch.targets.size();
    std::vector<float> times, weights((targets + 1) * targets, 0);
    for (std::size_t k = 0; k <= targets; ++k) {
      times.push_back(time_of(stretch.frames[k]));
      if (k > 0) weights[k * targets + k - 1] = 1;
    }
    add_channel(times, weights, 1, node, "weights", "LINEAR");
  }

  /// Returns the scale with which the mesh of the i-th range of frames is shown: 1 during these frames while
  /// the cloth exists, otherwise 0.
  SampleTrack<Vector3f> presence_of(const FilmCloth& cloth, const ClothRecord& record, std::size_t i) const {
    SampleTrack<Vector3f> scale;
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      const bool begun = frames_[k] >= record.stretches[i].frames.front();
      const bool over =
          i + 1 < record.stretches.size() && frames_[k] >= record.stretches[i + 1].frames.front();
      const bool shown = begun && !over && cloth.lifetime.contains(times_[k]);
      scale.add(frames_[k], shown ? Vector3f::Ones() : Vector3f::Zero());
    }
    return scale;
  }

  void add_camera() {
    const Eigen::Vector2i size = parts_.scene.render.size;
    cameras_.push_back({{"type", "perspective"},
                        {"perspective",
                         {{"aspectRatio", static_cast<double>(size.x()) / size.y()},
                          {"yfov", first_fov_deg_ * std::numbers::pi / 180},
                          {"znear", 0.05},
                          {"zfar", 1e4}}}});
    add_node({{"name", "Camera"}, {"camera", 0}}, camera_);
  }

  void add_lights() {
    const auto add = [&](Json light, const NodeTracks& tracks) {
      const std::string name = light["name"];
      lights_.push_back(std::move(light));
      add_node({{"name", name}, {"extensions", {{"KHR_lights_punctual", {{"light", lights_.size() - 1}}}}}},
               tracks);
    };
    // A white surface has the radiance L under an irradiance of pi L. glTF uses lux and candela. Scenes have
    // no absolute scale, so one unit stands for 1 W, which importers convert to 683 lm.
    constexpr float kLumens = 683;
    const float pi = std::numbers::pi_v<float>;
    const render::Sun& sun = parts_.sun;
    if (sun.intensity > 0) {
      NodeTracks tracks;
      tracks.add(1, Vector3f::Zero(), look_rotation(-sun.direction, Vector3f::UnitY()));
      add({{"name", "Sun"},
           {"type", "directional"},
           {"color", array(sun.color)},
           {"intensity", kLumens * pi * sun.intensity}},
          tracks);
    }
    for (std::size_t i = 0; i < first_lamps_.size(); ++i) {
      const render::Lamp& lamp = first_lamps_[i];
      const float brightness = std::max(lamp.intensity.maxCoeff(), 1e-12f);
      const bool cone = lamp.cone_deg > 0 || !lamp.size.isZero(0);
      Json light = {{"name", parts_.lamps[i]},
                    {"type", cone ? "spot" : "point"},
                    {"color", array(lamp.intensity / brightness)},
                    {"intensity", kLumens * pi * brightness}};
      if (cone) {
        const float outer = lamp.cone_deg > 0 ? lamp.cone_deg / 2 * pi / 180 : 1.5f;
        light["spot"] = {{"innerConeAngle", outer * (1 - std::clamp(lamp.softness, 0.01f, 1.f))},
                         {"outerConeAngle", outer}};
      }
      add(std::move(light), lamps_[i]);
    }
  }

  void write_file() {
    Json json = {{"asset", {{"version", "2.0"}, {"generator", "offstage " + std::string(version())}}},
                 {"scene", 0},
                 {"scenes", Json::array({{{"name", parts_.scene.name}, {"nodes", roots_}}})},
                 {"nodes", std::move(nodes_)},
                 {"cameras", std::move(cameras_)}};
    const auto add = [&](const char* key, Json& list) {
      if (!list.empty()) json[key] = std::move(list);
    };
    add("meshes", meshes_);
    add("materials", looks_.materials);
    add("textures", looks_.textures);
    add("images", looks_.images);
    add("samplers", looks_.samplers);
    if (!channels_.empty())
      json["animations"] = Json::array(
          {{{"name", "film"}, {"samplers", std::move(samplers_)}, {"channels", std::move(channels_)}}});
    std::set<std::string> used = looks_.used;
    if (!lights_.empty()) {
      used.insert("KHR_lights_punctual");
      json["extensions"] = {{"KHR_lights_punctual", {{"lights", std::move(lights_)}}}};
    }
    if (!used.empty()) json["extensionsUsed"] = used;
    add("accessors", buffer_.accessors);
    add("bufferViews", buffer_.views);
    if (buffer_.spool().size() > 0) json["buffers"] = Json::array({{{"byteLength", buffer_.spool().size()}}});
    std::string text = json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto binary = static_cast<uint32_t>(buffer_.spool().size());
    const auto length = static_cast<uint32_t>(text.size());
    put({kGlbMagic, 2, 12 + 8 + length + (binary > 0 ? 8 + binary : 0), length, kJsonChunk});
    file_.write({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
    if (binary > 0) {
      put({binary, kBinaryChunk});
      buffer_.spool().copy_to(file_);
    }
    file_.commit();
  }
  void put(std::initializer_list<uint32_t> words) {
    file_.write({reinterpret_cast<const uint8_t*>(words.begin()), 4 * words.size()});
  }

  const FilmParts& parts_;
  render::OutputFile file_;
  GltfBuffer buffer_;
  GltfLooks looks_;
  std::vector<int> frames_;
  std::vector<double> times_;  // of the frames [s]
  std::vector<NodeTracks> bodies_, rods_;
  std::vector<ClothRecord> cloths_;
  NodeTracks camera_;
  std::vector<NodeTracks> lamps_;
  std::vector<render::Lamp> first_lamps_;
  float first_fov_deg_ = 40;
  bool zooms_ = false, flickers_ = false;
  Json nodes_ = Json::array(), meshes_ = Json::array(), cameras_ = Json::array(), lights_ = Json::array(),
       samplers_ = Json::array(), channels_ = Json::array(), primitives_ = Json::array();
  std::vector<int> roots_;
  std::map<std::pair<std::size_t, std::size_t>, int> meshes_done_;
};

}  // namespace

std::unique_ptr<FilmExport> make_gltf_export(const fs::path& file, const FilmParts& parts) {
  return std::make_unique<GltfExport>(file, parts);
}

}  // namespace offstage::producer
