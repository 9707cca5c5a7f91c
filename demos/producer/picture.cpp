#include "producer/picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "effects/distribution.h"
#include "producer/cloth_defs.h"
#include "producer/lights.h"
#include "producer/line_sketch.h"
#include "producer/particle_sources.h"
#include "producer/texts.h"
#include "render/bloom.h"
#include "render/primitives.h"
#include "render/tone_map.h"

namespace offstage::producer {
namespace {

using Eigen::Affine3f;
using Eigen::Vector3f;

/// Half the edge of the square that stands for an infinite plane [m].
constexpr float kGroundHalfSize = 1000;

float f(Real value) {
  return static_cast<float>(value);
}

Affine3f affine(const Vec3& position, const Quat& orientation, Real scale = 1) {
  return Eigen::Translation3f(position.cast<float>()) * orientation.cast<float>() * Eigen::Scaling(f(scale));
}

Affine3f affine(const BodySample& s) {
  return Eigen::Translation3f(s.position) * s.orientation;
}

/// The mesh of a primitive, and the numbers that tell it from others. Boxes get a small bevel, so that their
/// edges catch light.
render::Mesh mesh_of(const sim::Sphere& s) {
  return render::make_sphere(f(s.radius));
}
render::Mesh mesh_of(const sim::Box& s) {
  return render::make_box(s.size.cast<float>(), 0.04f * f(s.size.minCoeff()));
}
render::Mesh mesh_of(const sim::Capsule& s) {
  return render::make_capsule(f(s.radius), f(s.height));
}
render::Mesh mesh_of(const sim::Cylinder& s) {
  return render::make_cylinder(f(s.radius), f(s.height));
}
render::Mesh mesh_of(const sim::Cone& s) {
  return render::make_cone(f(s.radius), f(s.height));
}
render::Mesh mesh_of(const sim::Plane&) {
  return render::make_ground(kGroundHalfSize);
}

std::vector<float> key_of(const sim::Sphere& s) {
  return {0, f(s.radius)};
}
std::vector<float> key_of(const sim::Box& s) {
  return {1, f(s.size.x()), f(s.size.y()), f(s.size.z())};
}
std::vector<float> key_of(const sim::Capsule& s) {
  return {2, f(s.radius), f(s.height)};
}
std::vector<float> key_of(const sim::Cylinder& s) {
  return {3, f(s.radius), f(s.height)};
}
std::vector<float> key_of(const sim::Cone& s) {
  return {4, f(s.radius), f(s.height)};
}
std::vector<float> key_of(const sim::Plane&) {
  return {5};
}

BodySample interpolate(const BodySample& a, const BodySample& b, float w) {
  return {a.position + w * (b.position - a.position), a.orientation.slerp(w, b.orientation)};
}

/// Where a particle is at share w of the interval `dt` between two states: the cubic through both states
/// while it flew freely; a straight line where a bounce came between, which a cubic would overshoot.
Vector3f interpolate(const render::Point& a, const render::Point& b, float w, float dt) {
  const Vector3f step = b.position - a.position;
  const Vector3f mean_velocity = 0.5f * (a.velocity + b.velocity);
  const bool free_flight = (step - mean_velocity * dt).norm() <= 0.1f * mean_velocity.norm() * dt;
  if (!free_flight) return a.position + w * step;
  const float w2 = w * w, w3 = w2 * w;
  return a.position + (3 * w2 - 2 * w3) * step +
         dt * ((w3 - 2 * w2 + w) * a.velocity + (w3 - w2) * b.velocity);
}

/// A point of a cloth between two states, by the cubic through both. Where a blow came between, the
/// velocities at both ends say little about the way: what they are off the mean one counts up to half of
/// that.
Vector3f interpolate(const Vector3f& a, const Vector3f& va, const Vector3f& b, const Vector3f& vb, float w,
                     float dt) {
  const Vector3f step = b - a;
  const float most = 0.5f * step.norm();
  const auto limited = [&](const Vector3f& v) -> Vector3f {
    const Vector3f off = dt * v - step;
    const float length = off.norm();
    return length > most ? Vector3f(off * (most / length)) : off;
  };
  const float rest = 1 - w;
  return a + w * step + w * rest * (rest * limited(va) - w * limited(vb));
}

/// The parts overlay of a body, or null.
const PartsOverlay* parts_overlay(const Scene& scene, const std::string& body) {
  for (const Overlay& overlay : scene.overlays)
    if (const auto* parts = std::get_if<PartsOverlay>(&overlay); parts && parts->body == body) return parts;
  return nullptr;
}

render::Mesh mesh_of(const sim::ConvexPolyhedron& part) {
  const sim::TriangleMesh triangles = part.triangles();
  render::Mesh mesh;
  for (const Vec3& v : triangles.vertices) mesh.positions.push_back(v.cast<float>());
  for (const sim::Triangle& t : triangles.triangles)
    mesh.indices.insert(mesh.indices.end(), t.begin(), t.end());
  render::compute_normals(mesh, 20);
  return mesh;
}

std::string name_or(const std::string& name, const char* kind, uint32_t id) {
  return name.empty() ? kind + (" " + std::to_string(id)) : name;
}

}  // namespace

std::map<uint32_t, std::string> object_names(const Scene& scene) {
  std::map<uint32_t, std::string> names;
  uint32_t id = 0;
  const auto add = [&](const std::string& name, const char* kind) {
    ++id;
    names[id] = name_or(name, kind, id);
  };
  for (const Body& body : scene.bodies) add(body.name, "body");
  for (const Cloth& cloth : scene.cloths) add(cloth.name, "cloth");
  for (const ParticleGroup& group : scene.particles) add(group.name, "particles");
  for (const Emitter& emitter : scene.emitters)
    for_each_source(emitter, [&](const ParticleSource&, const ParticleSource*, const std::string& name,
                                 const Birth&) { add(name, "particles"); });
  return names;
}

Picture::Picture(const Scene& scene, const ModelLibrary& models, render::Context& context)
    : scene_(scene),
      stage_(context, {.width_px = scene.render.size.x(),
                       .height_px = scene.render.size.y(),
                       .shadow_map_px = scene.render.shadow_map}),
      camera_(scene, models) {
  std::size_t slot = 0;
  uint32_t object = 0;
  for (const Body& body : scene.bodies) add_body(body, models, slot, ++object);
  for (const Spring& spring : scene.springs) {
    render::InstanceHandle rod;
    if (spring.visible)
      rod = stage_.add_instance(stage_.add_mesh(render::make_cylinder(f(spring.radius), 1)),
                                material(spring.material, models));
    springs_.push_back(rod);
  }
  for (const Cloth& cloth : scene.cloths) {
    add_cloth(cloth, models);
    ++object;
    if (cloths_.back().cloth) stage_.set_object(cloths_.back().cloth, object);
  }
  for (const ParticleLook* look : looks_of(scene)) {
    points_.push_back(stage_.add_points(points_def(*look)));
    stage_.set_object(points_.back(), ++object);
    styles_.push_back(points_def(*look).style);
    smears_.push_back(add_smears(*look));
  }
  add_overlay_lines();
  stage_.set_sun(sun_of(scene));
  stage_.set_environment(environment_of(scene));
}

render::PointsHandle Picture::add_smears(const ParticleLook& look) {
  render::PointsDef def = points_def(look);
  if (def.style != render::PointStyle::sphere || subframe_time() == 0) return {};
  def.style = render::PointStyle::streak;
  def.stretch_s = subframe_time();
  return stage_.add_points(def);
}

float Picture::subframe_time() const {
  const int n = subframes(scene_.render.quality);
  return n == 1 ? 0 : f(scene_.render.shutter / scene_.output.fps) / static_cast<float>(n);
}

void Picture::set_balls(std::size_t set, std::span<const render::Point> balls) {
  // A ball that moves by more than its radius from one sub-frame to the next would be seen as a row of balls.
  std::vector<render::Point> still;
  scratch_smears_.clear();
  for (const render::Point& ball : balls) {
    const float way = subframe_time() * ball.velocity.norm();
    if (way < ball.radius) {
      still.push_back(ball);
      continue;
    }
    scratch_smears_.push_back(ball);
    scratch_smears_.back().color.w() *= 1 / (1 + way * 2 / (std::numbers::pi_v<float> * ball.radius));
  }
  stage_.set_points(points_[set], still);
  stage_.set_points(smears_[set], scratch_smears_);
}

render::Material Picture::material_named(const std::string& name, const ModelLibrary& models,
                                         std::vector<render::Image>& textures) const {
  render::Material m;
  const auto it = std::ranges::find(scene_.materials, name, &Material::name);
  if (it != scene_.materials.end()) {
    m = {.name = it->name,
         .color = it->color.rgba,
         .metallic = f(it->metallic),
         .roughness = f(it->roughness),
         .emission = it->emission.rgb() * f(it->emission_strength),
         .transmission = f(it->transmission),
         .refraction = f(it->refraction),
         .pattern = it->pattern,
         .pattern_color = it->pattern_color.rgb(),
         .pattern_scale = f(it->pattern_scale),
         .two_sided = it->two_sided};
    if (!it->texture.empty()) {
      textures.push_back(models.texture(it->texture));
      m.base_color_texture = 0;
    }
  }
  return m;
}

render::MaterialHandle Picture::material(const std::string& name, const ModelLibrary& models) {
  if (const auto it = materials_.find(name); it != materials_.end()) return it->second;
  std::vector<render::Image> textures;
  const render::Material m = material_named(name, models, textures);
  return materials_[name] = stage_.add_material(m, textures);
}

render::MaterialHandle Picture::cloth_material(const Cloth& cloth, const ModelLibrary& models) {
  render::MaterialHandle& known = fabrics_[cloth.fabric + "/" + cloth.material];
  if (known) return known;
  render::Material m = fabric_look(cloth.fabric);
  std::vector<render::Image> textures;
  if (const auto it = std::ranges::find(scene_.materials, cloth.material, &Material::name);
      it != scene_.materials.end()) {
    render::Fabric fabric = m.fabric;
    fabric.back_color.reset();  // that of another front
    if (const std::optional<FabricLook>& look = it->fabric) {
      fabric = {.weave = look->weave,
                .thread = f(look->thread),
                .relief = f(look->relief),
                .sheen = f(look->sheen),
                .sheen_color = look->sheen_color.rgb(),
                .translucency = f(look->translucency)};
      if (look->back_color) fabric.back_color = look->back_color->rgb();
    }
    m = material_named(cloth.material, models, textures);
    m.fabric = fabric;
  }
  return known = stage_.add_material(m, textures);
}

void Picture::add_cloth(const Cloth& cloth, const ModelLibrary& models) {
  DrawnCloth drawn;
  if (cloth.visible) {
    const auto* mesh = std::get_if<MeshFile>(&cloth.shape);
    FlatCloth flat = flat_cloth(cloth, mesh ? &models.model(mesh->file) : nullptr);
    drawn.triangles = flat.triangles();
    drawn.uvs = std::move(flat.uvs);
    Eigen::AlignedBox2f box;
    for (const Eigen::Vector2f& uv : drawn.uvs) box.extend(uv);
    drawn.cloth = stage_.add_cloth({.triangles = drawn.triangles,
                                    .uvs = drawn.uvs,
                                    .thickness = f(flat.def.thickness),
                                    .texture_size = box.sizes().cwiseMax(1e-6f),
                                    .casts_shadow = cloth.casts_shadow},
                                   cloth_material(cloth, models));
  }
  cloths_.push_back(std::move(drawn));
}

void Picture::add_model(const std::string& file, const Affine3f& body_from_model, const Body& body,
                        const ModelLibrary& models, std::vector<DrawnPart>& parts) {
  const render::Model& model = models.model(file);
  const auto [it, is_new] = models_.try_emplace(file);
  auto& [meshes, own_materials] = it->second;
  if (is_new) {
    for (const render::Model::Part& part : model.parts) meshes.push_back(stage_.add_mesh(part.mesh));
    for (const render::Material& m : model.materials)
      own_materials.push_back(stage_.add_material(m, model.textures));
  }
  for (std::size_t i = 0; i < model.parts.size(); ++i) {
    const auto look = body.material.empty() && !own_materials.empty()
                          ? own_materials[static_cast<std::size_t>(model.parts[i].material)]
                          : material(body.material, models);
    parts.push_back({stage_.add_instance(meshes[i], look, body.casts_shadow), body_from_model});
  }
}

template <class Primitive>
render::MeshHandle Picture::primitive(const Primitive& shape) {
  render::MeshHandle& mesh = primitives_[key_of(shape)];
  if (!mesh) mesh = stage_.add_mesh(mesh_of(shape));
  return mesh;
}

void Picture::add_shape(const Body& body, const ModelLibrary& models, std::vector<DrawnPart>& parts) {
  std::visit(
      [&](const auto& shape) {
        using S = std::decay_t<decltype(shape)>;
        if constexpr (std::is_same_v<S, MeshFile>) {
          add_model(shape.file, affine(Vec3::Zero(), Quat::Identity(), shape.scale), body, models, parts);
        } else {
          // A plane is the ground: it takes shadows and throws none.
          const bool casts = body.casts_shadow && !std::is_same_v<S, sim::Plane>;
          parts.push_back({stage_.add_instance(primitive(shape), material(body.material, models), casts),
                           Affine3f::Identity()});
        }
      },
      body.shape);
}

void Picture::add_convex_parts(const MeshFile& mesh, const Body& body, const ModelLibrary& models,
                               std::vector<DrawnPart>& parts) {
  const std::vector<sim::ConvexPolyhedron>& convex = models.parts(mesh.file)->parts;
  sim::Aabb box;
  for (const sim::ConvexPolyhedron& part : convex) box.extend(part.box());
  for (std::size_t i = 0; i < convex.size(); ++i) {
    render::Material look{.roughness = 0.45f};
    look.color.head<3>() = distinct_color(i);
    const Vec3 outwards = mesh.scale * (convex[i].centre() - box.center());
    parts.push_back({stage_.add_instance(stage_.add_mesh(mesh_of(convex[i])), stage_.add_material(look),
                                         body.casts_shadow),
                     affine(Vec3::Zero(), Quat::Identity(), mesh.scale), outwards.cast<float>()});
  }
}

void Picture::add_body(const Body& body, const ModelLibrary& models, std::size_t& slot, uint32_t object) {
  DrawnBody drawn{{}, affine(body.position, body.orientation), parts_overlay(scene_, body.name), {}};
  if (drawn.overlay)
    add_convex_parts(std::get<MeshFile>(body.shape), body, models, drawn.parts);
  else if (body.visible && body.model)
    add_model(body.model->file, affine(body.model->position, body.model->orientation, body.model->scale),
              body, models, drawn.parts);
  else if (body.visible)
    add_shape(body, models, drawn.parts);

  for (const DrawnPart& part : drawn.parts) stage_.set_object(part.instance, object);
  place_body(drawn, drawn.world_from_body, 0);
  if (body.motion == sim::MotionType::fixed)
    places_.add_fixed(body.name, drawn.world_from_body);
  else
    places_.add_moving(body.name, *(drawn.slot = slot++));
  if (drawn.slot || drawn.overlay) bodies_.push_back(std::move(drawn));
}

void Picture::add_overlay_lines() {
  for (const Overlay& overlay : scene_.overlays) {
    overlays_.push_back(std::visit(
        [&]<class O>(const O& o) {
          if constexpr (std::is_base_of_v<LineLook, O>)
            return stage_.add_lines({.width = f(o.width), .hidden = f(o.hidden)});
          else
            return render::LinesHandle();
        },
        overlay));
  }
}

void Picture::place_springs(const Snapshot& previous, const Snapshot& current, float w) {
  for (std::size_t i = 0; i < springs_.size(); ++i) {
    if (!springs_[i]) continue;
    const SpringSample &s0 = previous.springs[i], &s1 = current.springs[i];
    const Vector3f a = s0.a + w * (s1.a - s0.a), b = s0.b + w * (s1.b - s0.b), d = b - a;
    const bool drawn = d.allFinite() && d.norm() > 1e-6f;
    stage_.set_visible(springs_[i], drawn);
    if (drawn)
      stage_.set_transform(springs_[i], Eigen::Translation3f(0.5f * (a + b)) *
                                            Eigen::Quaternionf::FromTwoVectors(Vector3f::UnitY(), d) *
                                            Eigen::Scaling(1.f, d.norm(), 1.f));
  }
}

void Picture::place_points(const Snapshot& previous, const Snapshot& current, float w, double frame_time) {
  const auto dt = static_cast<float>(frame_time);
  const float back = (1 - w) * dt;
  for (std::size_t set = 0; set < points_.size(); ++set) {
    const PointSet &before = previous.point_sets[set], &now = current.point_sets[set];
    // A streak is its own motion blur: it stays where the frame ends and is as long as its style says.
    const auto show = [&](std::span<const render::Point> points) {
      smears_[set] ? set_balls(set, points) : stage_.set_points(points_[set], points);
    };
    if (w == 1 || styles_[set] == render::PointStyle::streak) {
      show(now.points);
      continue;
    }
    scratch_.clear();
    std::size_t j = 0;
    for (std::size_t i = 0; i < now.points.size(); ++i) {
      render::Point p = now.points[i];
      while (j < before.points.size() && before.points[j].id < p.id) ++j;
      if (j < before.points.size() && before.points[j].id == p.id)
        p.position = interpolate(before.points[j], p, w, dt);
      else if (now.ages[i] < back)
        continue;  // not born yet
      else
        p.position -= back * p.velocity;
      scratch_.push_back(p);
    }
    show(scratch_);
  }
}

void Picture::give_mesh(DrawnCloth& drawn, const ClothSample& sample) {
  if (drawn.version == sample.version) return;
  drawn.version = sample.version;
  if (sample.version == 0) return stage_.set_cloth_mesh(drawn.cloth, drawn.triangles, drawn.uvs);
  std::vector<Eigen::Vector2f> uvs;
  for (const uint32_t source : sample.sources) uvs.push_back(drawn.uvs[source]);
  stage_.set_cloth_mesh(drawn.cloth, sample.triangles, uvs);
}

void Picture::place_cloths(const Snapshot& previous, const Snapshot& current, float w, double frame_time) {
  const auto dt = static_cast<float>(frame_time);
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (!cloths_[c].cloth) continue;
    const ClothSample &before = previous.cloths[c], &now = current.cloths[c];
    give_mesh(cloths_[c], now);
    scratch_places_ = now.points;
    for (std::size_t i = 0; w < 1 && i < now.points.size(); ++i)
      scratch_places_[i] =
          i < before.points.size()
              ? interpolate(before.points[i], before.velocities[i], now.points[i], now.velocities[i], w, dt)
              : Vector3f(now.points[i] - (1 - w) * dt * now.velocities[i]);
    stage_.set_cloth(cloths_[c].cloth, scratch_places_);
  }
}

void Picture::place_overlays(const Snapshot& previous, const Snapshot& current, float w) {
  for (std::size_t i = 0; i < overlays_.size(); ++i) {
    if (!overlays_[i]) continue;
    const LineSet &before = previous.overlays[i], &now = current.overlays[i];
    scratch_lines_ = now.lines;
    if (w < 1) {
      // Lines that came have no way between the two states.
      std::unordered_map<uint64_t, std::size_t> places;
      for (std::size_t k = 0; k < before.ids.size(); ++k) places.emplace(before.ids[k], k);
      for (std::size_t k = 0; k < scratch_lines_.size(); ++k) {
        const auto place = places.find(now.ids[k]);
        if (place == places.end()) continue;
        const render::Line& was = before.lines[place->second];
        render::Line& line = scratch_lines_[k];
        line.a = was.a + w * (line.a - was.a);
        line.b = was.b + w * (line.b - was.b);
      }
    }
    stage_.set_lines(overlays_[i], scratch_lines_);
  }
}

void Picture::place_body(const DrawnBody& body, const Affine3f& world_from_body, double time) {
  const float explode = body.overlay ? f(effects::mean(body.overlay->explode, time)) : 0;
  for (const DrawnPart& part : body.parts)
    stage_.set_transform(
        part.instance, world_from_body * Eigen::Translation3f(explode * part.outwards) * part.body_from_part);
}

void Picture::place(const Snapshot& previous, const Snapshot& current, float w, double frame_time) {
  std::vector<BodySample> samples(current.bodies.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = w == 1 ? current.bodies[i] : interpolate(previous.bodies[i], current.bodies[i], w);
  const double time = current.time - (1 - w) * frame_time;
  for (const DrawnBody& body : bodies_)
    place_body(body, body.slot ? affine(samples[*body.slot]) : body.world_from_body, time);
  place_springs(previous, current, w);
  place_points(previous, current, w, frame_time);
  place_cloths(previous, current, w, frame_time);
  place_overlays(previous, current, w);
  stage_.set_camera(camera_.at(time, places_, samples));
  stage_.set_lamps(lamps_of(scene_, time, places_, samples));
  stage_.set_time(f(time));
}

float Picture::exposure(double time, float sample_weight) const {
  const float factor = f(effects::mean(scene_.render.exposure, time));
  return scene_.render.metering == Metering::fixed ? factor
                                                   : factor * render::metered_exposure(sum_, sample_weight);
}

render::Channels Picture::channels(const Snapshot& previous, const Snapshot& current) {
  const double frame_time = &previous == &current ? 0 : 1 / scene_.output.fps;
  place(previous, previous, 1, frame_time);
  stage_.remember();
  place(previous, current, 1, frame_time);
  return stage_.channels(f(frame_time));
}

render::Image Picture::draw(const Snapshot& previous, const Snapshot& current) {
  const int n = subframes(scene_.render.quality);
  const double frame_time = 1 / scene_.output.fps;
  std::ranges::fill(sum_.rgba, 0.f);
  for (int i = 0; i < n; ++i) {
    // Sub-frames sit in the middle of equal parts of the time the shutter is open, which ends with the frame.
    const float open =
        f(scene_.render.shutter) * (1 - (static_cast<float>(i) + 0.5f) / static_cast<float>(n));
    const float w = n == 1 || &previous == &current ? 1 : 1 - open;
    place(previous, current, w, frame_time);
    stage_.draw(render::sample_offsets(i, n), sum_);
  }
  const float weight = 1 / static_cast<float>(n), exposed = exposure(current.time, weight);
  if (scene_.render.bloom > 0)
    render::add_bloom(sum_,
                      {.strength = f(scene_.render.bloom), .exposure = exposed, .sample_weight = weight});
  render::Image image = render::tone_map(
      sum_, {.curve = scene_.render.tone_curve, .exposure = exposed, .sample_weight = weight});
  if (n == 1) render::filter_edges(image);
  write_texts(scene_, current, image);
  return image;
}

}  // namespace offstage::producer
