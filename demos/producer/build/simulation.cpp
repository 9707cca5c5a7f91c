#include "producer/build/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/build/animated_bodies.h"
#include "producer/build/articulation_defs.h"
#include "producer/build/body_shapes.h"
#include "producer/build/cloth_defs.h"
#include "producer/build/emitter_defs.h"
#include "producer/build/force_defs.h"

namespace offstage::producer {
namespace {

const Material* find_material(const Scene& scene, const std::string& name) {
  const auto it = std::ranges::find(scene.materials, name, &Material::name);
  return it == scene.materials.end() ? nullptr : &*it;
}

sim::KeyframeTrack track_of(const Body& body) {
  sim::KeyframeTrack track{
      .keys = {}, .interpolation = body.interpolation, .loop = body.loop, .spin = body.spin};
  for (const BodyKey& key : body.keyframes)
    track.keys.push_back({key.time,
                          {key.position.value_or(body.position), key.orientation.value_or(body.orientation)},
                          key.interpolation});
  return track;
}

/// Runs `add`, and converts the simulation's exception to a problem at the place in the scene.
template <class F>
auto at_place(const Where& where, F&& add) {
  try {
    return add();
  } catch (const std::invalid_argument& error) {
    throw SceneError(where, error.what());
  }
}

std::size_t index_of(const sim::ParticleArrays& particles, uint64_t id) {
  const auto it = std::ranges::lower_bound(particles.id, id);
  return it != particles.id.end() && *it == id ? static_cast<std::size_t>(it - particles.id.begin())
                                               : particles.size();
}

ClothSample cloth_sample(const sim::ClothView& view) {
  ClothSample sample;
  for (const Vec3& p : view.points) sample.points.push_back(p.cast<float>());
  for (const Vec3& v : view.velocities) sample.velocities.push_back(v.cast<float>());
  sample.version = view.version;
  if (view.version == 0) return sample;
  for (const sim::Triangle& t : view.triangles)
    sample.triangles.insert(sample.triangles.end(), t.begin(), t.end());
  sample.sources.assign(view.sources.begin(), view.sources.end());
  return sample;
}

/// Returns the key of the collision mesh of a model.
std::string mesh_key(const MeshFile& file, const ModelLibrary& models) {
  return fmt::format("{}\n{}\n{}\n{:a}", models.digest(), ModelLibrary::parts_key(file),
                     models.parts(file) ? "parts" : "", scale_of(file, models));
}

/// Copies the contact properties of a body's material.
void set_contact(const Material& material, const Body& body, sim::BodyDef& def) {
  def.restitution = material.restitution;
  def.friction = material.friction;
  def.static_friction = material.static_friction.value_or(def.static_friction);
  def.rolling_friction = material.rolling_friction;
  def.spinning_friction = material.spinning_friction;
  if (!material.cross_friction || body.friction_axis.isZero(0)) return;
  def.cross_friction = *material.cross_friction;
  def.friction_axis = body.friction_axis;
}

/// Returns the names of the bodies whose collision shapes an overlay reads.
std::set<std::string> bodies_of_overlays(const Scene& scene) {
  std::set<std::string> names;
  for (const Overlay& overlay : scene.overlays) {
    if (const auto* tree = std::get_if<TreeOverlay>(&overlay)) names.insert(tree->body);
    if (const auto* closest = std::get_if<ClosestOverlay>(&overlay)) names.insert({closest->a, closest->b});
    if (const auto* contacts = std::get_if<ContactsOverlay>(&overlay))
      names.insert({contacts->a, contacts->b});
  }
  return names;
}

/// Returns a box as large as a model.
sim::Box box_around(const MeshFile& file, const ModelLibrary& models) {
  constexpr Real kLeast = 1e-6;  // [m]; a flat model has no height
  const Vec3 size = models.model(file.file).bounds().sizes().cast<Real>();
  return {(scale_of(file, models) * size).cwiseMax(kLeast)};
}

nlohmann::ordered_json stats_json(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

/// Records the cloths whose stiffness was reduced, and the cloths that tore.
void Simulation::note_cloths() {
  world_.for_each_cloth([&](sim::ClothHandle handle) {
    const sim::ClothReport& report = world_.cloth_report(handle);
    const std::string& name = world_.cloth_def(handle).name;
    if (report.clamped > 0) {
      sim::Real& least = totals_.softened_cloths.try_emplace(name, 1).first->second;
      least = std::min(least, report.least_stiffness);
    }
    if (!report.first_tear || totals_.first_tears.contains(name)) return;
    const sim::BodyHandle body = report.first_tear->body;
    totals_.first_tears[name] = {*report.first_tear, body ? world_.body_def(body).name : ""};
  });
}

Simulation::Simulation(const Scene& scene, const ModelLibrary& models, CollisionMeshes* shared)
    : scene_(scene), objects_(scene), world_(scene.world) {
  add_bodies(scene, models, shared);
  for (const ContactRule& rule : scene.contacts)
    at_place(rule.where, [&] {
      sim::ContactRule def = rule;
      def.a = rule.materials[0];
      def.b = rule.materials[1];
      world_.add_contact_rule(def);
    });
  add_particle_groups(scene);
  springs_.resize(scene.springs.size());
  add_springs(0);
  add_joints(scene);
  add_cloths(scene, models);
  sources_.emplace(scene, models, world_, [this](const std::string& name) { return body_named(name); });
  add_forces(scene);
  std::map<std::string, sim::ClothHandle> cloths;
  for (const auto& [name, handle] : cloths_) cloths.emplace(name, handle);
  overlays_.emplace(scene, world_, bodies_, cloths);
  prewarm_pieces_ = static_cast<int>(std::ceil(sources_->prewarm() * scene.output.fps.per_second()));
  // Particles released at time 0 exist at time 0.
  if (prewarm_pieces_ == 0) prewarm(0, 0);
}

void Simulation::add_bodies(const Scene& scene, const ModelLibrary& models, CollisionMeshes* shared) {
  std::map<std::string, sim::MeshHandle> meshes;
  std::vector<std::pair<const Body*, sim::BodyDef>> animated;
  std::map<std::vector<float>, sim::MeshHandle> compounds;
  const std::set<std::string> shown = bodies_of_overlays(scene);
  moving_.resize(objects_.slots);
  moving_poses_.resize(objects_.slots);
  for (const auto& [described, slot, id] : objects_.bodies) {
    const Body& body = *described;
    sim::BodyDef def{.name = body.name,
                     .motion = body.motion,
                     .pose = {body.position, body.orientation},
                     .velocity = body.velocity,
                     .angular_velocity = body.angular_velocity,
                     .density = body.density,
                     .mass = body.mass,
                     .linear_drag = body.linear_drag,
                     .angular_drag = body.angular_drag,
                     .material = body.material,
                     .surface_velocity = body.surface_velocity,
                     .collides = body.collides,
                     .track = track_of(body),
                     .appear_at = body.appear_at,
                     .remove_at = body.remove_at};
    def.centre = body.centre;
    def.inertia = inertia_of(body);
    if (const Material* material = find_material(scene, body.material)) set_contact(*material, body, def);
    if (body.has_animated_shape() && body.collides) {
      animated.emplace_back(&body, def);
      def.collides = false;  // the pieces of the animated shape collide instead
    }
    const sim::BodyHandle handle = at_place(body.where, [&] {
      std::visit(
          [&](const auto& shape) {
            if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, MeshFile>) {
              // Nothing reads the shape of a static body without collisions. Its collision mesh would take
              // milliseconds and memory for each size of a model, as in a forest of scaled trees.
              if (body.motion == sim::MotionType::static_body && !body.collides &&
                  !shown.contains(body.name)) {
                def.shape = box_around(shape, models);
                return;
              }
              const std::string key = mesh_key(shape, models);
              sim::MeshHandle& mesh = meshes[key];
              if (!mesh && shared && shared->contains(key)) mesh = world_.add_shared_mesh(shared->at(key));
              if (!mesh) mesh = add_mesh(shape, models);
              def.shape = sim::MeshShape{mesh};
            } else if constexpr (!std::is_constructible_v<sim::Shape, std::decay_t<decltype(shape)>>) {
              sim::MeshHandle& mesh = compounds[solids_key(body.shape)];
              if (!mesh) mesh = world_.add_compound(solids_of(body.shape));
              def.shape = sim::MeshShape{mesh};
              const sim::BodyMass mass = *mass_by_shape(body);
              def.mass = mass.mass;
              def.centre = mass.centre;
              def.inertia = mass.inertia;
            } else {
              def.shape = shape;
            }
          },
          body.shape);
      return world_.add_body(def);
    });
    bodies_[body.name] = handle;
    if (!slot) continue;
    slot_of_[handle] = *slot;
    moving_[*slot] = {body.name, handle};
    moving_poses_[*slot] = world_.body(handle).pose;
  }
  for (const auto& [body, def] : animated) add_pieces(*body, def, models);
  if (!shared) return;
  shared->clear();
  for (const auto& [key, mesh] : meshes) shared->emplace(key, world_.shared_mesh(mesh));
}

/// Adds the pieces of an animated shape as kinematic bodies. They are not among the bodies of the scene.
void Simulation::add_pieces(const Body& body, const sim::BodyDef& whole, const ModelLibrary& models) {
  const MeshFile& file = std::get<MeshFile>(body.shape);
  const render::ModelRig& rig = models.model(file.file).rig;
  const Real scale = scale_of(file, models);
  const Real end = scene_.output.start + scene_.output.duration;
  for (const AnimatedPiece& piece : models.pieces(body)) {
    sim::TriangleMesh mesh = piece.mesh;
    for (Vec3& vertex : mesh.vertices) vertex *= scale;
    sim::BodyDef def = whole;
    def.name = body.name + "/" + piece.name;
    def.motion = sim::MotionType::kinematic;
    def.track = piece_track(rig, piece, body.animation.value(), whole.track, whole.pose, scale, end);
    def.pose = def.track.at(0, whole.pose).pose;
    def.shape = sim::MeshShape{world_.add_mesh(mesh, scaled(piece.parts, scale))};
    at_place(body.where, [&] { world_.add_body(def); });
  }
}

sim::MeshHandle Simulation::add_mesh(const MeshFile& file, const ModelLibrary& models) {
  const sim::ConvexDecomposition* parts = models.parts(file);
  const Real scale = scale_of(file, models);
  return world_.add_mesh(collision_mesh(models.model(file.file), scale),
                         parts ? std::optional(scaled(*parts, scale)) : std::nullopt);
}

void Simulation::add_particle_groups(const Scene& scene) {
  for (const ParticleGroup& group : scene.particles) {
    const auto system = world_.add_particle_system(system_def(group.name, group.behaviour));
    if (group.appear_at == 0) add_particles(group, system, -1);
    groups_.push_back({&group, system, LookRamps(group.look, scene.world.seed, group.name)});
  }
}

/// Adds the particles of a group; `elapsed` is as for World::add_particle().
void Simulation::add_particles(const ParticleGroup& group, sim::ParticleSystemHandle system, Real elapsed) {
  for (const ParticlePlace& place : group.places)
    world_.add_particle(system,
                        {.position = place.position,
                         .velocity = place.velocity,
                         .mass = group.mass,
                         .radius = group.radius,
                         .lifespan = group.remove_at < kForever ? group.remove_at - group.appear_at
                                                                : sim::Particle{}.lifespan,
                         .restitution = group.restitution,
                         .friction = group.friction,
                         .charge = group.charge},
                        elapsed);
}

/// Adds the groups that appear in this sub-step, and the springs that end at their particles.
void Simulation::add_late_particles(Real start, Real end) {
  bool appears = false;
  for (const Group& group : groups_) {
    const Real at = group.scene->appear_at;
    if (at <= start || at > end) continue;
    add_particles(*group.scene, group.handle, end - at);
    appears = true;
  }
  if (appears) add_springs(end);
}

/// Adds the springs whose particles exist at a time, and that do not exist yet.
void Simulation::add_springs(Real time) {
  const auto exists = [&](const SpringEnd& end) {
    const auto group = std::ranges::find(scene_.particles, end.particles, &ParticleGroup::name);
    return end.particles.empty() || group->appear_at <= time;
  };
  const auto attachment = [&](const SpringEnd& end) -> sim::Attachment {
    if (!end.body.empty()) return sim::BodyPoint{body_named(end.body), end.position};
    if (!end.particles.empty()) {
      const sim::ParticleSystemHandle group = system_named(end.particles);
      return sim::ParticlePoint{group, world_.particles(group).id[static_cast<std::size_t>(end.index)]};
    }
    return sim::WorldPoint{end.position};
  };
  for (std::size_t i = 0; i < scene_.springs.size(); ++i) {
    const Spring& spring = scene_.springs[i];
    if (springs_[i] || !exists(spring.a) || !exists(spring.b)) continue;
    springs_[i] = {.name = spring.name,
                   .a = attachment(spring.a),
                   .b = attachment(spring.b),
                   .stiffness = spring.stiffness,
                   .damping = spring.damping,
                   .rest_length = spring.rest_length};
    at_place(spring.where, [&] { world_.add_spring(*springs_[i]); });
  }
}

void Simulation::add_joints(const Scene& scene) {
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const Joint& joint = scene.joints[i];
    sim::JointDef def = joint_def(joint);
    def.a = body_named(joint.a);
    def.b = body_named(joint.b);
    at_place(joint.where, [&] {
      const sim::JointHandle handle = world_.add_joint(def);
      if (rod_count(joint) > 0) joints_.push_back({handle, objects_.rod_of_joint[i]});
    });
  }
}

void Simulation::add_cloths(const Scene& scene, const ModelLibrary& models) {
  for (const Cloth& cloth : scene.cloths) {
    const auto* mesh = std::get_if<MeshFile>(&cloth.shape);
    FlatCloth flat =
        at_place(cloth.where, [&] { return flat_cloth(cloth, mesh ? &models.model(mesh->file) : nullptr); });
    const auto pin = [&](const std::string& name, uint32_t vertex, Real until) {
      const sim::BodyHandle body = body_named(name);
      const Vec3& p = flat.def.vertices[vertex];
      flat.def.pins.push_back({.vertex = vertex,
                               .body = body,
                               .position = body ? world_.body(body).pose.point_to_body(p) : p,
                               .until = until});
    };
    for (const ClothPin& selection : cloth.pins) {
      const PinScope& scope = scope_of(selection);
      const std::vector<uint32_t> held =
          at_place(scope.where, [&] { return pinned_vertices(selection, cloth, flat); });
      if (held.empty()) throw SceneError(scope.where, selects_nothing(flat));
      for (const uint32_t vertex : held) pin(scope.body, vertex, scope.until);
    }
    for (std::size_t i = 0; i < cloth.cords.size(); ++i) {
      const ClothCord& cord = cloth.cords[i];
      if (cord.held) pin(cord.body, flat.cord_ends[i], cord.until);
    }
    if (const auto what = instability_of(scene, flat.def)) throw SceneError(cloth.where, *what);
    at_place(cloth.where, [&] { cloths_.push_back({cloth.name, world_.add_cloth(flat.def)}); });
  }
}

void Simulation::add_forces(const Scene& scene) {
  for (const Force& force : scene.forces) {
    sim::ForceDef def = force_def(force);
    const ForceTargets targets = targets_of(force);
    for (const std::string& name : targets.bodies) def.bodies.push_back(body_named(name));
    for (const std::string& name : targets.particles) def.systems.push_back(system_named(name));
    for (const std::string& name : targets.cloths)
      def.cloths.push_back(std::ranges::find(cloths_, name, &NamedCloth::name)->handle);
    at_place(named(force).where, [&] { world_.add_force(def); });
  }
}

sim::ParticleSystemHandle Simulation::system_named(const std::string& name) const {
  const auto group =
      std::ranges::find(groups_, name, [](const Group& g) -> const std::string& { return g.scene->name; });
  return group == groups_.end() ? sources_->system(name) : group->handle;
}

sim::BodyHandle Simulation::body_named(const std::string& name) const {
  const auto it = bodies_.find(name);
  return it == bodies_.end() ? sim::BodyHandle{} : it->second;
}

void Simulation::prewarm(double from, double to) {
  note(world_.prewarm(from, to, [&](Real start, Real end) { sources_->emit(world_, start, end); }));
}

SimulationTotals Simulation::totals() const {
  constexpr Real kRounding = 1e-9;
  SimulationTotals all = totals_;
  all.step_s = scene_.world.max_step;
  for (const sim::BodyOverlap& overlap : world_.overlaps(kRounding))
    all.contacts.penetration = std::max(all.contacts.penetration, overlap.depth);
  return all;
}

void Simulation::step(double sampling_time) {
  const sim::StepReport report = world_.step(sampling_time, [&](Real start, Real end) {
    if (on_substep_) on_substep_(start);
    overlays_->record(world_);
    add_late_particles(start, end);
    sources_->emit(world_, start, end);
  });
  for (const sim::MovedBody& moved : world_.moved())
    if (const auto slot = slot_of_.find(moved.body); slot != slot_of_.end())
      moving_poses_[slot->second] = moved.pose;
  note(report);
}

void Simulation::note(const sim::StepReport& report) {
  totals_.add(report);
  note_cloths();
  totals_.contacts.points = world_.contacts().size();
  totals_.most_contacts = std::max(totals_.most_contacts, totals_.contacts.points);
  const ParticleSources::Counts counts = sources_->counts();
  totals_.waiting = counts.waiting;
  totals_.skipped = counts.skipped;
  for (const sim::JointHandle broken : report.joints_broken)
    totals_.broken_joints.push_back(world_.joint_def(broken).name);
  for (const sim::BodyHandle lost : report.bodies_retired)
    totals_.lost_bodies.push_back(world_.body_def(lost).name);
  for (const sim::RoughContact& rough : report.rough_contacts) {
    if (totals_.rough_bodies.empty()) totals_.first_rough_s = world_.time();
    const sim::BodyDef &a = world_.body_def(rough.a), &b = world_.body_def(rough.b);
    ++totals_.rough_bodies[a.motion == sim::MotionType::dynamic ? a.name : b.name];
  }

  if (report.finite) return;
  const sim::ClothDef* cloth = nullptr;
  world_.for_each_cloth([&](sim::ClothHandle handle) {
    const sim::ClothDef& def = world_.cloth_def(handle);
    if (!world_.cloth_report(handle).finite && def.name == report.non_finite.object) cloth = &def;
  });
  const char* advice = "Reduce world.step or the forces";
  if (cloth)
    advice = cloth->integrator == sim::ClothIntegrator::implicit
                 ? "Reduce its \"substep\", or make it less stiff"
                 : "Reduce its \"substep\", use \"integrator\": \"implicit\", or make it less stiff";
  throw DivergedError(
      fmt::format(
          "the simulation diverged at {:.4f} s: {}'{}' has a position or velocity that is not finite. {}",
          world_.time(), cloth ? "cloth " : "", report.non_finite.object, advice),
      state_dump(report.non_finite));
}

sim::Energy Simulation::energy() const {
  const sim::Energy energy = world_.energy();
  if (!std::isfinite(energy.kinetic + energy.potential + energy.elastic))
    fail("the energy is not finite; use smaller masses, speeds or forces");
  return energy;
}

void Simulation::fail(const std::string& what) const {
  throw DivergedError(fmt::format("the simulation diverged at {:.4f} s: {}", world_.time(), what),
                      state_dump({}));
}

int Simulation::skipped_pieces() const {
  return static_cast<int>(std::ceil(scene_.output.start * scene_.output.fps.per_second()));
}

void Simulation::advance() {
  // The time before frame 1 is simulated in frame-sized pieces, too, so that a caller can stop in between.
  if (prewarmed_pieces_ < prewarm_pieces_) {
    const double piece = sources_->prewarm() / prewarm_pieces_;
    const int left = prewarm_pieces_ - ++prewarmed_pieces_;
    return prewarm(-piece * (left + 1), -piece * left);
  }
  const int pieces = skipped_pieces();
  if (skipped_pieces_ < pieces) {
    step(scene_.output.start / pieces);
    ++skipped_pieces_;
    return;
  }
  if (frame_ > 0) step(scene_.output.fps.seconds(1));
  ++frame_;
}

Snapshot Simulation::snapshot() const {
  Snapshot snapshot;
  snapshot.frame = frame_;
  snapshot.time = scene_.output.time_of(frame_);
  for (const sim::Pose& pose : moving_poses_)
    snapshot.bodies.push_back({pose.position.cast<float>(), pose.orientation.cast<float>()});

  const Eigen::Vector3f nowhere = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  const auto end_point = [&](const sim::Attachment& attachment) -> Eigen::Vector3f {
    if (const auto* body = std::get_if<sim::BodyPoint>(&attachment); body && !world_.is_present(body->body))
      return nowhere;
    if (const auto* body = std::get_if<sim::BodyPoint>(&attachment))
      return world_.body(body->body).pose.point_to_world(body->position).cast<float>();
    if (const auto* particle = std::get_if<sim::ParticlePoint>(&attachment)) {
      const sim::ParticleArrays& particles = world_.particles(particle->system);
      const std::size_t i = index_of(particles, particle->id);
      return i < particles.size() ? Eigen::Vector3f(particles.position[i].cast<float>()) : nowhere;
    }
    return std::get<sim::WorldPoint>(attachment).position.cast<float>();
  };
  snapshot.rods.resize(objects_.rods.size());
  for (std::size_t i = 0; i < springs_.size(); ++i)
    snapshot.rods[objects_.rod_of_spring[i]] =
        springs_[i] ? RodSample{end_point(springs_[i]->a), end_point(springs_[i]->b)}
                    : RodSample{nowhere, nowhere};
  for (const auto& [handle, first_rod] : joints_) {
    const sim::JointState state = world_.joint(handle);
    const sim::JointDef& def = world_.joint_def(handle);
    std::vector<Vec3> corners = {state.anchor_a, state.anchor_b};
    if (def.type == sim::JointType::pulley)
      corners = {state.anchor_a, def.pulley_a, def.pulley_b, state.anchor_b};
    for (std::size_t i = 0; i + 1 < corners.size(); ++i)
      snapshot.rods[first_rod + i] = {corners[i].cast<float>(),
                                      corners[state.broken ? i : i + 1].cast<float>()};
  }
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    const sim::ClothView view = world_.cloth(cloths_[i].handle);
    std::size_t rod = objects_.rod_of_cloth[i];
    for (const sim::ClothSpring& s : view.springs)
      if (s.kind == sim::SpringKind::cord)
        snapshot.rods[rod++] = {view.points[s.a].cast<float>(), view.points[s.b].cast<float>()};
  }

  for (const Group& group : groups_)
    snapshot.point_sets.push_back(
        group.look.points(world_.particles(group.handle), world_.time(), &group.scene->places));
  sources_->add_points(world_, snapshot.point_sets);
  for (const NamedCloth& cloth : cloths_) snapshot.cloths.push_back(cloth_sample(world_.cloth(cloth.handle)));
  snapshot.overlays = overlays_->lines(world_);
  snapshot.state_hash = world_.state_hash();
  return snapshot;
}

void Simulation::for_each_particle_system(
    const std::function<void(const std::string&, const sim::ParticleArrays&, const PointSet&)>& visit) const {
  for (const Group& group : groups_) {
    const sim::ParticleArrays& particles = world_.particles(group.handle);
    visit(group.scene->name, particles, group.look.points(particles, world_.time(), &group.scene->places));
  }
  sources_->for_each_system(
      [&](const std::string& name, sim::ParticleSystemHandle handle, const LookRamps& look) {
        const sim::ParticleArrays& particles = world_.particles(handle);
        visit(name, particles, look.points(particles, world_.time(), nullptr));
      });
}

std::string Simulation::state_dump(const sim::NonFinite& lost) const {
  // JSON has no infinite numbers and NaN, so they are written as text.
  const auto text = [](const Vec3& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); };
  nlohmann::ordered_json dump;
  dump["time"] = world_.time();
  dump["frame"] = frame_;
  dump["not_finite"] = {{"object", lost.object},
                        {"particle", lost.particle},
                        {"position_before", text(lost.position_before)},
                        {"velocity_before", text(lost.velocity_before)},
                        {"position", text(lost.position)},
                        {"velocity", text(lost.velocity)}};
  auto& bodies = dump["bodies"] = nlohmann::ordered_json::array();
  for (const NamedBody& body : moving_) {
    const sim::BodyState s = world_.body(body.handle);
    bodies.push_back(
        {{"name", body.name},
         {"position", stats_json(s.pose.position)},
         {"orientation",
          {s.pose.orientation.w(), s.pose.orientation.x(), s.pose.orientation.y(), s.pose.orientation.z()}},
         {"velocity", stats_json(s.velocity)},
         {"angular_velocity", stats_json(s.angular_velocity)}});
  }
  auto& systems = dump["particles"] = nlohmann::ordered_json::array();
  world_.for_each_particle_system([&](sim::ParticleSystemHandle handle) {
    const sim::ParticleArrays& p = world_.particles(handle);
    systems.push_back({{"name", world_.particle_system_def(handle).name}, {"count", p.size()}});
  });
  return dump.dump(2) + "\n";
}

}  // namespace offstage::producer
