#include "producer/export/film_parts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "producer/base/to_float.h"
#include "producer/build/body_shapes.h"
#include "producer/build/cloth_defs.h"
#include "producer/build/drawn_objects.h"
#include "producer/build/lights.h"
#include "producer/build/object_table.h"
#include "render/primitives.h"
#include "sim/core/rotation.h"

namespace offstage::producer {
namespace {

using Eigen::Affine3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kGroundHalf_m = 100;  // half side of the square that stands for an infinite plane

Affine3f placed(const Vec3& position, const Quat& orientation, Real scale) {
  return Eigen::Translation3f(position.cast<float>()) * orientation.cast<float>() *
         Eigen::Scaling(to_float(scale));
}

/// Returns a square that replaces the renderer's mesh of the ground, which reaches to the horizon.
render::Mesh ground_square() {
  constexpr float r = kGroundHalf_m;
  return {.positions = {{-r, 0, -r}, {-r, 0, r}, {r, 0, r}, {r, 0, -r}},
          .normals = std::vector<Vector3f>(4, Vector3f::UnitY()),
          .uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}},
          .indices = {0, 1, 2, 0, 2, 3}};
}

/// Makes names unique.
class UniqueNames {
 public:
  std::string operator()(const std::string& wanted, const char* otherwise) {
    const std::string base = wanted.empty() ? otherwise : wanted;
    std::string name = base;
    for (int i = 2; !taken_.insert(name).second; ++i) name = base + "_" + std::to_string(i);
    return name;
  }

 private:
  std::set<std::string> taken_;
};

}  // namespace

class FilmParts::Builder {
 public:
  Builder(FilmParts& parts, const Scene& scene, const ModelLibrary& models)
      : parts_(parts), scene_(scene), models_(models) {}

  void add_body(const ObjectTable::BodyEntry& entry) {
    const Body& body = *entry.body;
    FilmBody film{.name = names_(body.name, "body"),
                  .slot = entry.slot,
                  .place = {body.position.cast<float>(), body.orientation.cast<float>()},
                  .parts = {},
                  .lifetime = {body.appear_at, body.remove_at}};
    if (!body.visible) return;
    if (body.model)
      add_model(body.model->file,
                placed(body.model->position, body.model->orientation, scale_of(*body.model, models_)),
                body.material, film);
    else
      std::visit([&](const auto& shape) { add_shape(shape, body, film); }, body.shape);
    parts_.bodies.push_back(std::move(film));
  }

  void add_rod(const ObjectTable::RodEntry& rod, std::size_t index) {
    if (!rod.visible) return;
    parts_.rods.push_back(
        {names_(rod.name, rod.kind), index,
         mesh({6, to_float(rod.radius)}, [&] { return render::make_cylinder(to_float(rod.radius), 1); }),
         material(rod.material)});
  }

  void add_cloth(const Cloth& cloth, std::size_t index) {
    if (!cloth.visible) return;
    const auto* file = std::get_if<MeshFile>(&cloth.shape);
    FlatCloth flat = flat_cloth(cloth, file ? &models_.model(file->file) : nullptr);
    Eigen::AlignedBox2f box;
    for (const Vector2f& uv : flat.uvs) box.extend(uv);
    const Vector2f size = box.sizes().cwiseMax(1e-6f);
    FilmCloth film{.name = names_(cloth.name, "cloth"),
                   .lifetime = {cloth.appear_at, cloth.remove_at},
                   .cloth = index,
                   .material = cloth_material(cloth),
                   .triangles = flat.triangles(),
                   .uvs = {}};
    for (const Vector2f& uv : flat.uvs) {
      const Vector2f fraction = (uv - box.min()).cwiseQuotient(size);
      film.uvs.push_back({fraction.x(), 1 - fraction.y()});
    }
    parts_.cloths.push_back(std::move(film));
  }

  std::string unique(const std::string& name, const char* otherwise) { return names_(name, otherwise); }

 private:
  template <class S>
  void add_shape(const S& shape, const Body& body, FilmBody& film) {
    if constexpr (std::is_same_v<S, MeshFile>) {
      add_model(shape.file, placed(Vec3::Zero(), Quat::Identity(), scale_of(shape, models_)), body.material,
                film);
    } else if constexpr (std::is_same_v<S, Compound>) {
      for (const CompoundPart& part : shape.parts) {
        const std::string& look = part.material.empty() ? body.material : part.material;
        const std::size_t own = std::visit(
            [&](const auto& s) {
              return primitive(DrawnShape{s, body.bevel});
            },
            part.shape);
        film.parts.push_back({own, material(look), placed(part.position, part.orientation, 1)});
      }
    } else if constexpr (std::is_same_v<S, sim::Plane>) {
      film.parts.push_back({mesh(shape_key(shape), ground_square), material(body.material)});
    } else {
      film.parts.push_back({primitive(DrawnShape{shape, body.bevel}), material(body.material)});
    }
  }

  template <class S>
  std::size_t primitive(const DrawnShape<S>& drawn) {
    return mesh(drawn.key(), [&] { return drawn.mesh(); });
  }

  void add_model(const std::string& file, const Affine3f& body_from_model, const std::string& material_name,
                 FilmBody& film) {
    const render::Model& model = models_.model(file);
    const bool own_look = material_name.empty() && !model.materials.empty();
    const auto [it, is_new] = models_done_.try_emplace({file, own_look});
    auto& [first_mesh, first_material] = it->second;
    if (is_new) {
      first_mesh = parts_.meshes.size();
      for (const render::Model::Part& part : model.parts) parts_.meshes.push_back(part.mesh);
      first_material = parts_.materials.size();
      if (own_look) add_materials(model.materials, model.textures);
    }
    for (std::size_t i = 0; i < model.parts.size(); ++i)
      film.parts.push_back({first_mesh + i,
                            own_look ? first_material + static_cast<std::size_t>(model.parts[i].material)
                                     : material(material_name),
                            body_from_model});
  }

  template <class Make>
  std::size_t mesh(const std::vector<float>& key, Make&& make) {
    const auto [it, is_new] = meshes_done_.try_emplace(key, parts_.meshes.size());
    if (is_new) parts_.meshes.push_back(make());
    return it->second;
  }

  std::size_t material(const std::string& name) {
    const auto [it, is_new] = materials_done_.try_emplace(name, parts_.materials.size());
    if (is_new) {
      std::vector<render::Image> textures;
      const render::Material look = material_of(scene_, name, models_, textures);
      add_material(look, textures);
    }
    return it->second;
  }

  std::size_t cloth_material(const Cloth& cloth) {
    const auto [it, is_new] =
        materials_done_.try_emplace("cloth/" + cloth.fabric + "/" + cloth.material, parts_.materials.size());
    if (is_new) {
      std::vector<render::Image> textures;
      render::Material look = material_of(scene_, cloth, models_, textures);
      if (look.name.empty()) look.name = cloth.fabric;
      add_material(look, textures);
    }
    return it->second;
  }

  /// Adds a material, whose maps have indices of `textures`.
  void add_material(const render::Material& look, const std::vector<render::Image>& textures) {
    add_materials({&look, 1}, textures);
  }
  void add_materials(std::span<const render::Material> looks, const std::vector<render::Image>& textures) {
    const auto first = static_cast<int>(parts_.textures.size());
    parts_.textures.insert(parts_.textures.end(), textures.begin(), textures.end());
    for (const render::Material& look : looks) {
      parts_.materials.push_back({material_names_(look.name, "material"), look});
      render::for_each_texture(parts_.materials.back().look, [&](render::TextureMap& map) {
        if (map.image >= 0) map.image += first;
      });
    }
  }

  FilmParts& parts_;
  const Scene& scene_;
  const ModelLibrary& models_;
  UniqueNames names_, material_names_;
  std::map<std::vector<float>, std::size_t> meshes_done_;
  std::map<std::string, std::size_t> materials_done_;
  /// The parts that were made for each model file. Key: the file, and whether the parts have its materials.
  std::map<std::pair<std::string, bool>, std::pair<std::size_t, std::size_t>> models_done_;
};

FilmParts::FilmParts(const Scene& s, const ModelLibrary& models)
    : scene(s), models_(models), camera_(s, models) {
  Builder builder(*this, s, models);
  const ObjectTable objects(s);
  places_ = BodyPlaces(objects);
  for (const ObjectTable::BodyEntry& entry : objects.bodies) builder.add_body(entry);
  for (std::size_t i = 0; i < objects.rods.size(); ++i) builder.add_rod(objects.rods[i], i);
  for (std::size_t i = 0; i < objects.cloths.size(); ++i) builder.add_cloth(*objects.cloths[i].cloth, i);
  for (std::size_t i = 0; i < objects.point_sets.size(); ++i) {
    const auto& [name, look, id] = objects.point_sets[i];
    points.push_back(
        {builder.unique(name, "particles"), i, !points_def(*look).lit, look->style == LookStyle::sphere});
  }
  for (const std::string& name : lamp_names(s, models)) lamps.push_back(builder.unique(name, "lamp"));
  sun = sun_of(s, models);
}

bool FilmParts::has_alpha(const render::TextureMap& map) const {
  const render::Image* image = texture(map);
  for (std::size_t i = 3; image != nullptr && i < image->rgba.size(); i += 4)
    if (image->rgba[i] != 255) return true;
  return false;
}

render::Camera FilmParts::camera_at(const Snapshot& snapshot) const {
  return camera_.at(snapshot.time, places_, snapshot.bodies);
}

std::vector<render::Lamp> FilmParts::lamps_at(const Snapshot& snapshot) const {
  return lamps_of(scene, models_, snapshot.time, places_, snapshot.bodies);
}

std::optional<Affine3f> rod_transform(const RodSample& rod) {
  const Vector3f d = rod.b - rod.a;
  if (!d.allFinite() || d.norm() <= 1e-6f) return {};
  return Affine3f(Eigen::Translation3f(0.5f * (rod.a + rod.b)) * sim::rotation_between(Vector3f::UnitY(), d) *
                  Eigen::Scaling(1.f, d.norm(), 1.f));
}

ClothSurface cloth_surface(const FilmCloth& cloth, const ClothSample& sample) {
  ClothSurface surface{sample.version == 0 ? &cloth.triangles : &sample.triangles, {}, {}};
  if (sample.version == 0) {
    surface.uvs = cloth.uvs;
  } else {
    for (const uint32_t source : sample.sources) surface.uvs.push_back(cloth.uvs[source]);
  }
  surface.normals.assign(sample.points.size(), Vector3f::Zero());
  const std::vector<uint32_t>& t = *surface.triangles;
  for (std::size_t i = 0; i + 2 < t.size(); i += 3) {
    const Vector3f &a = sample.points[t[i]], &b = sample.points[t[i + 1]], &c = sample.points[t[i + 2]];
    const Vector3f doubled_area = (b - a).cross(c - a);
    for (std::size_t k = 0; k < 3; ++k) surface.normals[t[i + k]] += doubled_area;
  }
  for (Vector3f& n : surface.normals)
    n = n.norm() > 0 ? Vector3f(n.normalized()) : Vector3f(Vector3f::UnitY());
  return surface;
}

UvTransform uv_transform(const render::Material& look, const render::TextureMap& map) {
  if (look.triplanar) return {};
  const Vector3f &u = map.rows[0], &v = map.rows[1];
  UvTransform result;
  // u = (c sx, s sy, ox), v = (-s sx, c sy, oy) with c and s of the angle.
  result.scale.x() = std::hypot(u.x(), v.x());
  result.angle = result.scale.x() > 0 ? std::atan2(-v.x(), u.x()) : std::atan2(u.y(), v.y());
  result.scale.y() = std::sin(result.angle) * u.y() + std::cos(result.angle) * v.y();
  result.offset = {u.z(), v.z()};
  return result;
}

}  // namespace offstage::producer
