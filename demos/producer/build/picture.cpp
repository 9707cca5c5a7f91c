#include "producer/build/picture.h"

#include <algorithm>

#include "effects/distribution.h"
#include "producer/base/to_float.h"
#include "producer/build/body_shapes.h"
#include "producer/build/cloth_defs.h"
#include "producer/build/drawn_objects.h"
#include "producer/build/lights.h"
#include "producer/build/line_sketch.h"
#include "producer/build/texts.h"
#include "render/bloom.h"
#include "render/error.h"
#include "render/primitives.h"
#include "render/tone_map.h"

namespace offstage::producer {
namespace {

using Eigen::Affine3f;
using Eigen::Vector3f;

Affine3f affine(const Vec3& position, const Quat& orientation, Real scale = 1) {
  return Eigen::Translation3f(position.cast<float>()) * orientation.cast<float>() *
         Eigen::Scaling(to_float(scale));
}

/// Returns the overlay that draws the convex parts of a body, or null.
const PartsOverlay* parts_overlay(const Scene& scene, const std::string& body) {
  for (const Overlay& overlay : scene.overlays)
    if (const auto* parts = std::get_if<PartsOverlay>(&overlay); parts && parts->body == body) return parts;
  return nullptr;
}

/// Returns the transform that fits some meshes with their poses into the unit ball. It moves the centre of
/// their common bounding box to the origin, and the vertex farthest from it to a distance of 1.
Affine3f into_unit_ball(const std::vector<std::pair<render::Mesh, Affine3f>>& meshes) {
  Eigen::AlignedBox3f box;
  for (const auto& [mesh, whole_from_part] : meshes)
    for (const Vector3f& p : mesh.positions) box.extend(whole_from_part * p);
  float radius = 0;
  for (const auto& [mesh, whole_from_part] : meshes)
    for (const Vector3f& p : mesh.positions)
      radius = std::max(radius, (whole_from_part * p - box.center()).norm());
  return Eigen::Scaling(1 / std::max(radius, 1e-9f)) * Eigen::Translation3f(-box.center());
}

/// Returns the mesh of a shape for particles. Their balls have fewer triangles than those of bodies, because
/// particles are many and small.
template <class Shape>
render::Mesh particle_mesh_of(const Shape& shape) {
  return mesh_of(shape);
}
render::Mesh particle_mesh_of(const sim::Sphere& s) {
  return render::make_sphere(to_float(s.radius), 32);
}

}  // namespace

Picture::Picture(const Scene& scene, const ModelLibrary& models, render::Context& context, bool quick)
    : scene_(scene),
      library_(models),
      stage_(context,
             {.width_px = scene.render.size.x(), .height_px = scene.render.size.y(), .quick = quick}),
      camera_(scene, models) {
  const ObjectTable objects(scene);
  places_ = BodyPlaces(objects);
  for (const ObjectTable::BodyEntry& entry : objects.bodies) add_body(entry, models);
  for (const ObjectTable::RodEntry& entry : objects.rods) add_rod(entry, models);
  for (const ObjectTable::ClothEntry& entry : objects.cloths) add_cloth(entry, models);
  for (const ObjectTable::PointsEntry& entry : objects.point_sets) add_points(entry, models);
  add_overlay_lines();
  stage_.set_sun(sun_of(scene, models));
  render::Environment environment = environment_of(scene);
  environment.picture = models.sky();
  stage_.set_environment(environment);
}

void Picture::add_rod(const ObjectTable::RodEntry& rod, const ModelLibrary& models) {
  rods_.push_back(rod.visible
                      ? stage_.add_instance(stage_.add_mesh(render::make_cylinder(to_float(rod.radius), 1)),
                                            material(rod.material, models))
                      : render::InstanceHandle());
}

void Picture::add_points(const ObjectTable::PointsEntry& entry, const ModelLibrary& models) {
  const ParticleLook& look = *entry.look;
  const render::PointsDef def = points_def(look);
  const bool has_picture = look.style == LookStyle::sprite && !look.texture.empty();
  points_.push_back(stage_.add_points(def, has_picture ? models.texture(look.texture) : render::Image{}));
  stage_.set_object(points_.back(), entry.id);
  styles_.push_back(def.style);
  ages_within_frame_.push_back(has_picture && look.sheet);
  blur_streaks_.push_back(add_blur_streaks(look));
  meshes_.emplace_back();
  if (look.style == LookStyle::mesh) add_particle_mesh(look, models, entry.id);
}

void Picture::add_particle_mesh(const ParticleLook& look, const ModelLibrary& models, uint32_t object) {
  DrawnMeshes& drawn = meshes_.back();
  drawn.look = &look.mesh.value();
  drawn.casts_shadow = points_def(look).casts_shadow;
  drawn.object = object;
  std::vector<std::pair<render::Mesh, Affine3f>> meshes;
  const auto add = [&](const auto& shape, const std::string& name, const Affine3f& whole_from_part) {
    render::Mesh mesh = particle_mesh_of(shape);
    drawn.parts.push_back({stage_.add_mesh(mesh), material(name, models), whole_from_part});
    meshes.emplace_back(std::move(mesh), whole_from_part);
  };
  const std::string& own = drawn.look->material;
  std::visit(
      [&]<class S>(const S& shape) {
        if constexpr (std::is_same_v<S, MeshFile>) {
          for (const auto& [mesh, handle] : model_parts(shape.file, own, models))
            drawn.parts.push_back({mesh, handle, Affine3f::Identity()});
          for (const render::Model::Part& part : models.model(shape.file).parts)
            meshes.emplace_back(part.mesh, Affine3f::Identity());
        } else if constexpr (std::is_same_v<S, Compound>) {
          for (const CompoundPart& part : shape.parts)
            std::visit(
                [&](const auto& solid) {
                  add(solid, part.material.empty() ? own : part.material,
                      affine(part.position, part.orientation));
                },
                part.shape);
        } else {
          add(shape, own, Affine3f::Identity());
        }
      },
      drawn.look->shape);
  const Affine3f unit_from_whole = into_unit_ball(meshes);
  for (DrawnMeshes::Part& part : drawn.parts) part.unit_from_part = unit_from_whole * part.unit_from_part;
}

render::PointsHandle Picture::add_blur_streaks(const ParticleLook& look) {
  render::PointsDef def = points_def(look);
  if (look.style == LookStyle::mesh || def.style != render::PointStyle::sphere || subframe_time() == 0)
    return {};
  def.style = render::PointStyle::streak;
  def.stretch_s = subframe_time();
  return stage_.add_points(def);
}

render::MaterialHandle Picture::material(const std::string& name, const ModelLibrary& models) {
  if (const auto it = materials_.find(name); it != materials_.end()) return it->second;
  std::vector<render::Image> textures;
  const render::Material m = material_of(scene_, name, models, textures);
  return materials_[name] = stage_.add_material(m, textures);
}

render::MaterialHandle Picture::cloth_material(const Cloth& cloth, const ModelLibrary& models) {
  render::MaterialHandle& known = fabrics_[cloth.fabric + "/" + cloth.material];
  if (known) return known;
  std::vector<render::Image> textures;
  const render::Material m = material_of(scene_, cloth, models, textures);
  return known = stage_.add_material(m, textures);
}

void Picture::add_cloth(const ObjectTable::ClothEntry& entry, const ModelLibrary& models) {
  const Cloth& cloth = *entry.cloth;
  DrawnCloth drawn;
  drawn.appear_at = cloth.appear_at;
  drawn.remove_at = cloth.remove_at;
  if (cloth.visible) {
    const auto* mesh = std::get_if<MeshFile>(&cloth.shape);
    FlatCloth flat = flat_cloth(cloth, mesh ? &models.model(mesh->file) : nullptr);
    drawn.triangles = flat.triangles();
    drawn.uvs = std::move(flat.uvs);
    Eigen::AlignedBox2f box;
    for (const Eigen::Vector2f& uv : drawn.uvs) box.extend(uv);
    drawn.cloth = stage_.add_cloth({.triangles = drawn.triangles,
                                    .uvs = drawn.uvs,
                                    .thickness = to_float(flat.def.thickness),
                                    .texture_size = box.sizes().cwiseMax(1e-6f),
                                    .casts_shadow = cloth.casts_shadow},
                                   cloth_material(cloth, models));
    stage_.set_object(drawn.cloth, entry.id);
  }
  cloths_.push_back(std::move(drawn));
}

void Picture::add_model(const std::string& file, const Affine3f& body_from_model, const Body& body,
                        const ModelLibrary& models, std::vector<DrawnPart>& parts) {
  for (const auto& [mesh, look] : model_parts(file, body.material, models))
    parts.push_back({stage_.add_instance(mesh, look, body.casts_shadow), body_from_model});
}

std::vector<std::pair<render::MeshHandle, render::MaterialHandle>> Picture::model_parts(
    const std::string& file, const std::string& name, const ModelLibrary& models) {
  const render::Model& model = models.model(file);
  const auto [it, is_new] = models_.try_emplace(file);
  auto& [meshes, own_materials] = it->second;
  if (is_new) {
    for (const render::Model::Part& part : model.parts) meshes.push_back(stage_.add_mesh(part.mesh));
    for (const render::Material& m : model.materials)
      own_materials.push_back(stage_.add_material(m, model.textures));
  }
  std::vector<std::pair<render::MeshHandle, render::MaterialHandle>> parts;
  for (std::size_t i = 0; i < model.parts.size(); ++i)
    parts.emplace_back(meshes[i], name.empty() && !own_materials.empty()
                                      ? own_materials[static_cast<std::size_t>(model.parts[i].material)]
                                      : material(name, models));
  return parts;
}

template <class Primitive>
render::MeshHandle Picture::primitive(const Primitive& shape, const Body& body) {
  const DrawnShape drawn{shape, body.bevel};
  render::MeshHandle& mesh = primitives_[drawn.key()];
  if (!mesh) mesh = stage_.add_mesh(drawn.mesh());
  return mesh;
}

void Picture::add_shape(const Body& body, const ModelLibrary& models, std::vector<DrawnPart>& parts) {
  std::visit(
      [&](const auto& shape) {
        using S = std::decay_t<decltype(shape)>;
        if constexpr (std::is_same_v<S, MeshFile>) {
          add_model(shape.file, affine(Vec3::Zero(), Quat::Identity(), scale_of(shape, models)), body, models,
                    parts);
        } else if constexpr (std::is_same_v<S, Compound>) {
          for (const CompoundPart& part : shape.parts) {
            const auto mesh = std::visit([&](const auto& own) { return primitive(own, body); }, part.shape);
            const std::string& look = part.material.empty() ? body.material : part.material;
            parts.push_back({stage_.add_instance(mesh, material(look, models), body.casts_shadow),
                             affine(part.position, part.orientation)});
          }
        } else {
          // A plane is the ground: it receives shadows and casts none.
          const bool casts = body.casts_shadow && !std::is_same_v<S, sim::Plane>;
          parts.push_back(
              {stage_.add_instance(primitive(shape, body), material(body.material, models), casts),
               Affine3f::Identity()});
        }
      },
      body.shape);
}

void Picture::add_convex_parts(const MeshFile& mesh, const Body& body, const ModelLibrary& models,
                               std::vector<DrawnPart>& parts) {
  const std::vector<sim::ConvexPolyhedron>& convex = models.parts(mesh)->parts;
  const Real scale = scale_of(mesh, models);
  sim::Aabb box;
  for (const sim::ConvexPolyhedron& part : convex) box.extend(part.box());
  for (std::size_t i = 0; i < convex.size(); ++i) {
    render::Material look{.roughness = 0.45f};
    look.color.head<3>() = distinct_color(i);
    const Vec3 outwards = scale * (convex[i].centre() - box.center());
    parts.push_back({stage_.add_instance(stage_.add_mesh(mesh_of(convex[i])), stage_.add_material(look),
                                         body.casts_shadow),
                     affine(Vec3::Zero(), Quat::Identity(), scale), outwards.cast<float>()});
  }
}

void Picture::add_body(const ObjectTable::BodyEntry& entry, const ModelLibrary& models) {
  const Body& body = *entry.body;
  DrawnBody drawn{entry.slot,
                  affine(body.position, body.orientation),
                  parts_overlay(scene_, body.name),
                  body.appear_at,
                  body.remove_at,
                  {},
                  {}};
  const auto add_file = [&](const std::string& file, const Affine3f& body_from_model) {
    if (body.animation)
      add_animated(file, body_from_model, body, models, drawn);
    else
      add_model(file, body_from_model, body, models, drawn.parts);
  };
  if (drawn.overlay)
    add_convex_parts(std::get<MeshFile>(body.shape), body, models, drawn.parts);
  else if (body.visible && body.model)
    add_file(body.model->file,
             affine(body.model->position, body.model->orientation, scale_of(*body.model, models)));
  else if (body.visible && body.has_animated_shape())
    add_file(animated_file(body),
             affine(Vec3::Zero(), Quat::Identity(), scale_of(std::get<MeshFile>(body.shape), models)));
  else if (body.visible)
    add_shape(body, models, drawn.parts);

  for (const DrawnPart& part : drawn.parts) stage_.set_object(part.instance, entry.id);
  if (drawn.animated)
    for (const AnimatedLook::Surface& surface : drawn.animated->surfaces)
      stage_.set_object(surface.instance, entry.id);
  place_body(drawn, drawn.world_from_body, 0);
  const bool has_lifetime = body.appear_at > 0 || body.remove_at < kForever;
  if (drawn.slot || drawn.overlay || drawn.animated || has_lifetime) bodies_.push_back(std::move(drawn));
}

void Picture::add_animated(const std::string& file, const Affine3f& body_from_model, const Body& body,
                           const ModelLibrary& models, DrawnBody& drawn) {
  const render::Model& model = models.model(file);
  model_parts(file, body.material, models);  // this call uploads the materials
  const std::vector<render::MaterialHandle>& own_materials = models_.at(file).second;
  AnimatedLook look{
      &model.rig, &body.animation.value(), model.rig.clip(body.animation->clip), body_from_model, {}};
  for (const render::RigSurface& surface : model.rig.surfaces) {
    const render::MeshHandle mesh = stage_.add_mesh(surface.mesh);
    const render::MaterialHandle own = body.material.empty()
                                           ? own_materials[static_cast<std::size_t>(surface.material)]
                                           : material(body.material, models);
    look.surfaces.push_back({&surface, mesh, stage_.add_instance(mesh, own, body.casts_shadow)});
  }
  drawn.animated = std::move(look);
}

void Picture::add_overlay_lines() {
  for (const Overlay& overlay : scene_.overlays) {
    overlays_.push_back(std::visit(
        [&]<class O>(const O& o) {
          if constexpr (std::is_base_of_v<LineLook, O>)
            return stage_.add_lines({.width = to_float(o.width), .hidden = to_float(o.hidden)});
          else
            return render::LinesHandle();
        },
        overlay));
  }
}

float Picture::exposure(double time, float sample_weight) const {
  const float factor = to_float(effects::mean(scene_.render.exposure, time));
  return scene_.render.metering == Metering::fixed ? factor
                                                   : factor * render::metered_exposure(sum_, sample_weight);
}

render::HdrImage Picture::linear() const {
  render::HdrImage image = sum_;
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) image.rgba[4 * i + c] *= latest_scale_;
    image.rgba[4 * i + 3] *= 1 / static_cast<float>(subframes(scene_.render.quality));
  }
  return image;
}

render::Channels Picture::channels(const Snapshot& previous, const Snapshot& current) {
  const double frame_time = &previous == &current ? 0 : scene_.output.fps.seconds(1);
  place(previous, previous, 1, frame_time);
  // Instances are numbered by the particles of the current state, so that each has a motion in the channels.
  std::vector<render::Point> before;
  for (std::size_t set = 0; set < meshes_.size(); ++set) {
    if (!meshes_[set].look) continue;
    before.clear();
    points_at(set, previous, current, 0, frame_time, true, before);
    place_meshes(meshes_[set], before,
                 orientations_at(previous.point_sets[set], current.point_sets[set], 0, before));
  }
  stage_.store_previous_transforms();
  place(previous, current, 1, frame_time);
  return stage_.channels(to_float(frame_time));
}

render::Image Picture::draw(const Snapshot& previous, const Snapshot& current,
                            const std::function<bool()>& stop) {
  const int n = subframes(scene_.render.quality);
  const double frame_time = scene_.output.fps.seconds(1);
  std::ranges::fill(sum_.rgba, 0.f);
  for (int i = 0; i < n; ++i) {
    if (stop && stop()) return {};
    // The shutter closes at the frame's time. The time during which it is open is divided into equal parts,
    // and a sub-frame shows the middle of each part.
    const float open =
        to_float(scene_.render.shutter) * (1 - (static_cast<float>(i) + 0.5f) / static_cast<float>(n));
    const float w = n == 1 || &previous == &current ? 1 : 1 - open;
    place(previous, current, w, frame_time);
    try {
      stage_.draw(render::sample_offsets(i, n), sum_, stop);
    } catch (const render::StoppedError&) {
      return {};
    }
  }
  const float weight = 1 / static_cast<float>(n), exposed = exposure(current.time, weight);
  latest_scale_ = weight * exposed;
  if (scene_.render.bloom > 0)
    render::add_bloom(
        sum_, {.strength = to_float(scene_.render.bloom), .exposure = exposed, .sample_weight = weight});
  render::Image image = render::tone_map(
      sum_, {.curve = scene_.render.tone_curve, .exposure = exposed, .sample_weight = weight});
  if (n == 1) render::filter_edges(image);
  write_texts(scene_, current, image);
  return image;
}

}  // namespace offstage::producer
