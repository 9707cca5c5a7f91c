#include "sim/world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "sim/articulation/joint_energy.h"
#include "sim/contact/contact_lcp.h"
#include "sim/dynamics/pair_forces.h"
#include "sim/geometry/solid_check.h"
#include "sim/world/coupled_system.h"
#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

// Within these limits the solvers can square and multiply without overflow.
constexpr Real kLeastMass = 1e-40, kMostMass = 1e40;  // [kg]
constexpr Real kMostInertia = 1e100;                  // [kg m^2], and limit of the inverse
constexpr Real kMostCoordinate = 1e12;                // greatest coordinate of a mesh [m]

[[noreturn]] void refuse(const std::string& object, const std::string& what) {
  throw std::invalid_argument(object + ": " + what);
}

std::string quoted(const char* kind, const std::string& name) {
  return name.empty() ? std::string(kind) : std::string(kind) + " \"" + name + '"';
}

void check_positive(const std::string& object, const char* field, Real value) {
  if (!(value > 0) || !std::isfinite(value))
    refuse(object, std::string(field) + " is " + std::to_string(value) + ", allowed is a finite number > 0");
}

void check_not_negative(const std::string& object, const char* field, Real value) {
  if (!(value >= 0) || !std::isfinite(value))
    refuse(object, std::string(field) + " is " + std::to_string(value) + ", allowed is a finite number >= 0");
}

void check_finite(const std::string& object, const char* field, const Vec3& value) {
  if (!value.allFinite()) refuse(object, std::string(field) + " must be finite");
}

void check_pose(const std::string& object, const char* field, const Pose& pose) {
  check_finite(object, field, pose.position);
  const Real norm = pose.orientation.norm();
  if (!(std::abs(norm - 1) < 1e-6))
    refuse(object,
           std::string(field) + " has a quaternion of length " + std::to_string(norm) + ", allowed is 1");
}

void check_size(const std::string& o, const Sphere& s) {
  check_positive(o, "radius", s.radius);
}
void check_size(const std::string& o, const Box& b) {
  for (int i = 0; i < 3; ++i) check_positive(o, "size", b.size[i]);
}
void check_size(const std::string& o, const Capsule& c) {
  check_positive(o, "radius", c.radius);
  check_not_negative(o, "height", c.height);
}
void check_size(const std::string& o, const Cylinder& c) {
  check_positive(o, "radius", c.radius);
  check_positive(o, "height", c.height);
}
void check_size(const std::string& o, const Cone& c) {
  check_positive(o, "radius", c.radius);
  check_positive(o, "height", c.height);
}
void check_size(const std::string& o, const Frustum& c) {
  check_positive(o, "radius", c.radius);
  check_positive(o, "top_radius", c.top_radius);
  check_positive(o, "height", c.height);
}
void check_size(const std::string& o, const Ellipsoid& e) {
  for (int i = 0; i < 3; ++i) check_positive(o, "radii", e.radii[i]);
}
void check_size(const std::string&, const Plane&) {}
void check_size(const std::string&, const MeshShape&) {}

void check_track(const std::string& object, const KeyframeTrack& track) {
  check_finite(object, "track.spin", track.spin);
  for (std::size_t i = 0; i < track.keys.size(); ++i) {
    check_pose(object, "track.keys", track.keys[i].pose);
    if (!std::isfinite(track.keys[i].time) || (i > 0 && track.keys[i].time <= track.keys[i - 1].time))
      refuse(object, "track.keys: times must be finite and strictly increasing");
  }
}

void check_restitution(const std::string& object, Real e) {
  if (!(e >= 0 && e <= 1)) refuse(object, "restitution is " + std::to_string(e) + ", allowed is 0 to 1");
}

/// The principal moments of a solid are integrals of squares, so none exceeds the sum of the other two.
void check_inertia(const std::string& object, const Mat3& inertia) {
  constexpr Real kRounding = 1e-9;
  if (!inertia.allFinite()) refuse(object, "inertia must be finite");
  const Real scale = inertia.cwiseAbs().maxCoeff();
  if (!((inertia - inertia.transpose()).cwiseAbs().maxCoeff() <= kRounding * scale))
    refuse(object, "inertia must be symmetric");
  const Vec3 moments = diagonalise(inertia).moments;
  std::ostringstream values;
  values << moments.x() << ", " << moments.y() << " and " << moments.z() << " kg m^2";
  if (!(moments.x() > kRounding * scale))
    refuse(object, "inertia has the principal moments " + values.str() + ", allowed are moments > 0");
  if (moments.z() > (1 + kRounding) * (moments.x() + moments.y()))
    refuse(object, "inertia has the principal moments " + values.str() +
                       "; the largest may not exceed the sum of the other two");
}

void check_body(const std::string& object, const BodyDef& def) {
  std::visit([&](const auto& shape) { check_size(object, shape); }, def.shape);
  check_pose(object, "pose", def.pose);
  check_finite(object, "velocity", def.velocity);
  check_finite(object, "angular_velocity", def.angular_velocity);
  check_not_negative(object, "mass", def.mass);
  if (def.mass == 0) check_positive(object, "density", def.density);
  check_not_negative(object, "linear_drag", def.linear_drag);
  check_not_negative(object, "angular_drag", def.angular_drag);
  check_not_negative(object, "friction", def.friction);
  check_not_negative(object, "rolling_friction", def.rolling_friction);
  check_not_negative(object, "spinning_friction", def.spinning_friction);
  check_restitution(object, def.restitution);
  check_finite(object, "friction_axis", def.friction_axis);
  check_finite(object, "surface_velocity", def.surface_velocity);
  for (const auto& [field, value] :
       {std::pair("static_friction", def.static_friction), {"cross_friction", def.cross_friction}})
    if (!std::isfinite(value)) refuse(object, std::string(field) + " must be finite");
  if (def.cross_friction >= 0 && def.friction_axis == Vec3::Zero())
    refuse(object, "cross_friction needs a friction_axis that is not 0 0 0");
  if (def.cross_friction > 0 && def.friction == 0)
    refuse(object, "cross_friction needs friction > 0, the coefficient along the axis");
  if (def.centre) check_finite(object, "centre", *def.centre);
  if (def.inertia) check_inertia(object, *def.inertia);
  check_track(object, def.track);
  if (!(def.appear_at >= 0) || !std::isfinite(def.appear_at) || !(def.remove_at > def.appear_at))
    refuse(object, "appear_at is " + std::to_string(def.appear_at) + " s and remove_at " +
                       std::to_string(def.remove_at) +
                       " s; appear_at must be >= 0 and remove_at later than appear_at");
}

void check_mesh(const std::string& object, const TriangleMesh& mesh) {
  for (const Vec3& v : mesh.vertices) {
    check_finite(object, "a vertex", v);
    if (v.cwiseAbs().maxCoeff() > kMostCoordinate)
      refuse(object, "a coordinate is beyond 1e12 m; use a smaller scale");
  }
  for (const Triangle& t : mesh.triangles)
    for (uint32_t v : t)
      if (v >= mesh.vertices.size())
        refuse(object, "vertex index " + std::to_string(v) + " is out of range; the mesh has " +
                           std::to_string(mesh.vertices.size()) + " vertices");
}

RigidBody make_rigid_body(const std::string& object, const BodyDef& def, const Solid& solid) {
  if (solid.mesh && !solid.mesh->solid) refuse(object, problem_of_solid(solid.mesh->topology.defects()));
  const MassProperties unit = solid.mesh ? solid.mesh->mass : mass_properties(def.shape);
  if (!(unit.volume > 0)) refuse(object, "a dynamic body needs a solid shape, this one has no volume");
  RigidBody rigid;
  rigid.mass = def.mass > 0 ? def.mass : def.density * unit.volume;
  rigid.centre = def.centre.value_or(unit.centre);
  rigid.inertia = def.inertia ? Mat3((*def.inertia + def.inertia->transpose()) / 2)
                              : Mat3(rigid.mass / unit.volume * unit.inertia);
  rigid.inverse_inertia = rigid.inertia.inverse();
  const bool in_range = rigid.mass >= kLeastMass && rigid.mass <= kMostMass && rigid.centre.allFinite() &&
                        rigid.inertia.allFinite() && rigid.inverse_inertia.allFinite() &&
                        rigid.inertia.cwiseAbs().maxCoeff() < kMostInertia &&
                        rigid.inverse_inertia.cwiseAbs().maxCoeff() < kMostInertia;
  if (!in_range) {
    std::ostringstream what;
    what << "its mass is " << rigid.mass << " kg and its largest moment of inertia "
         << rigid.inertia.diagonal().maxCoeff() << " kg m^2, allowed are masses of " << kLeastMass << " to "
         << kMostMass << " kg and moments of 1e-100 to 1e100 kg m^2";
    refuse(object, what.str());
  }
  rigid.linear_drag = def.linear_drag;
  rigid.angular_drag = def.angular_drag;
  rigid.place(def.pose);
  rigid.set_velocity(def.velocity, def.angular_velocity);
  return rigid;
}

/// Returns the potential energy of the forces between particles [J].
Real pair_energy(const WorldState& world, Real time) {
  Real energy = 0;
  world.force_defs.for_each([&](ForceHandle, const ForceDef& def) {
    if (!def.is_pairwise()) return;
    std::vector<Real> x;
    std::vector<PairMember> members;
    world.systems.for_each([&](ParticleSystemHandle handle, const ParticleSystem& system) {
      if (!def.acts_on(handle)) return;
      const ParticleArrays& p = system.arrays;
      for (std::size_t i = 0; i < p.size(); ++i) {
        members.push_back({members.size(), p.mass[i], p.charge[i]});
        x.insert(x.end(), p.position[i].begin(), p.position[i].end());
      }
    });
    PairForces forces;
    forces.add(def, std::move(members));
    energy += forces.potential_energy(time, x);
  });
  return energy;
}

}  // namespace

World::World(const WorldDef& def) : impl_(std::make_unique<Impl>()) {
  check_positive("world", "max_step", def.max_step);
  check_finite("world", "gravity", def.gravity);
  check_finite("world", "wind", def.wind);
  check_positive("world", "collision_speed", def.collision_speed);
  check_positive("world", "integration_error", def.integration_error);
  check_positive("world", "collision.cell_factor", def.collision.cell_factor);
  if (def.particle_cluster < 1 || def.particle_cluster > kMostLcpContacts)
    refuse("world", "particle_cluster must be between 1 and 64");
  if (def.bounds.isEmpty()) refuse("world", "bounds are empty");
  impl_->def = def;
  impl_->contacts.use(def.collision);
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

MeshHandle World::add_mesh(const TriangleMesh& mesh, std::optional<ConvexDecomposition> decomposition) {
  check_mesh("mesh", mesh);
  TriangleMesh welded = weld(mesh);
  if (welded.triangles.empty()) refuse("mesh", "it has no face");
  return impl_->meshes.insert(std::make_unique<CollisionMesh>(std::move(welded), std::move(decomposition)));
}

MeshHandle World::add_compound(const std::vector<SolidMesh>& solids) {
  if (solids.empty()) refuse("compound", "it has no parts");
  std::vector<SolidMesh> welded;
  for (const SolidMesh& solid : solids) {
    check_mesh("compound", solid.mesh);
    if (solid.parts.empty()) refuse("compound", "a part has no convex solids");
    welded.push_back(solid);
    welded.back().mesh = weld(solid.mesh);
    if (welded.back().mesh.triangles.empty()) refuse("compound", "a part has no face");
  }
  return impl_->meshes.insert(std::make_unique<CollisionMesh>(std::move(welded)));
}

MeshHandle World::add_shared_mesh(std::shared_ptr<const CollisionMesh> mesh) {
  if (!mesh) refuse("mesh", "it is null");
  return impl_->meshes.insert(std::move(mesh));
}

std::shared_ptr<const CollisionMesh> World::shared_mesh(MeshHandle mesh) const {
  return impl_->meshes[mesh];
}

const MeshTopology& World::topology(MeshHandle mesh) const {
  return impl_->meshes[mesh]->topology;
}
const TriangleMesh& World::mesh(MeshHandle mesh) const {
  return impl_->meshes[mesh]->mesh;
}

const CollisionMesh& World::collision_mesh(MeshHandle mesh) const {
  return *impl_->meshes[mesh];
}

namespace {

TreeChoice tree_choice(const CollisionMethods& methods, MotionType motion) {
  using Trees = CollisionMethods::Trees;
  const bool dynamic = motion == MotionType::dynamic;
  const bool spheres = methods.trees == Trees::sphere || (methods.trees == Trees::mixed && dynamic);
  return {.volume = spheres                       ? TreeVolume::sphere
                    : methods.trees == Trees::obb ? TreeVolume::obb
                                                  : TreeVolume::aabb,
          .split = methods.tree_split};
}

}  // namespace

BodyHandle World::add_body(const BodyDef& def) {
  const std::string object = quoted("body", def.name);
  check_body(object, def);
  auto body = std::make_unique<Body>();
  body->def = def;
  body->type = def.motion;
  body->tree = tree_choice(impl_->def.collision, def.motion);
  body->solid.shape = &body->def.shape;
  if (const auto* shape = std::get_if<MeshShape>(&def.shape)) {
    const auto* mesh = impl_->meshes.find(shape->mesh);
    if (!mesh) refuse(object, "its mesh is not registered");
    body->solid.mesh = mesh->get();
  }
  body->pose = {def.pose.position, def.pose.orientation.normalized()};
  if (def.motion == MotionType::dynamic) body->rigid = make_rigid_body(object, def, body->solid);
  if (def.motion == MotionType::kinematic) body->pose = def.track.at(impl_->now, def.pose).pose;
  body->before_step = body->before_substep = body->start_pose = body->pose;
  body->extent =
      std::holds_alternative<Plane>(def.shape) ? std::numeric_limits<Real>::infinity() : reach(body->solid);
  body->surface = impl_->materials.number(def.material);
  if (def.appear_at > impl_->now) body->absent = true, body->type = MotionType::static_body;
  body->was_present = !body->absent;
  impl_->has_lifetimes |= body->absent || std::isfinite(def.remove_at);
  impl_->active.note_new_set();
  const BodyHandle handle = impl_->bodies.insert(std::move(body));
  impl_->bodies[handle]->handle = handle;
  impl_->contacts.add(*impl_->bodies[handle]);
  return handle;
}

ParticleSystemHandle World::add_particle_system(const ParticleSystemDef& def) {
  const std::string object = quoted("particle system", def.name);
  check_not_negative(object, "linear_drag", def.linear_drag);
  check_finite(object, "force", def.force);
  ParticleSystem system;
  system.def = def;
  const ParticleSystemHandle handle = impl_->systems.insert(std::move(system));
  impl_->systems[handle].handle = handle;
  return handle;
}

SpringHandle World::add_spring(const SpringDef& def) {
  const std::string object = quoted("spring", def.name);
  check_not_negative(object, "stiffness", def.stiffness);
  check_not_negative(object, "damping", def.damping);
  if (!impl_->is_alive(def.a) || !impl_->is_alive(def.b))
    refuse(object, "an end is attached to an object that does not exist");
  const Real rest =
      def.rest_length >= 0 ? def.rest_length : (impl_->position(def.a) - impl_->position(def.b)).norm();
  for (const Attachment* end : {&def.a, &def.b})
    if (const auto* point = std::get_if<BodyPoint>(end)) impl_->active.wake(*impl_->bodies[point->body]);
  return impl_->springs.insert({def, rest});
}

ForceHandle World::add_force(const ForceDef& def) {
  const std::string wrong = problem(def);
  if (!wrong.empty()) refuse(quoted("force", def.name), wrong);
  impl_->active.wake_all();
  return impl_->force_defs.insert(def);
}

void World::add_contact_rule(const ContactRule& rule) {
  const std::string object = "contact rule of \"" + rule.a + "\" and \"" + rule.b + '"';
  if (rule.restitution) check_restitution(object, *rule.restitution);
  if (rule.friction) check_not_negative(object, "friction", *rule.friction);
  if (rule.static_friction) check_not_negative(object, "static_friction", *rule.static_friction);
  if (rule.rolling_friction) check_not_negative(object, "rolling_friction", *rule.rolling_friction);
  if (rule.spinning_friction) check_not_negative(object, "spinning_friction", *rule.spinning_friction);
  impl_->materials.add(rule);
  impl_->contacts.forget_all();
  impl_->islands.clear();
  impl_->active.wake_all();
}

bool World::remove(BodyHandle body) {
  const auto* found = impl_->bodies.find(body);
  if (!found) return false;
  impl_->detach(**found);
  impl_->cloth_motion.detach(body);
  impl_->joint_groups.detach(**found, impl_->active);
  impl_->reactions.forget(**found);
  impl_->contacts.remove(**found);
  impl_->bodies.erase(body);
  std::erase_if(impl_->moved, [&](const MovedBody& m) { return m.body == body; });
  impl_->active.note_new_set();
  impl_->remove_dead_springs();
  return true;
}

bool World::remove(ForceHandle force) {
  impl_->active.wake_all();
  return impl_->force_defs.erase(force);
}

void World::set_velocity(BodyHandle handle, const Vec3& velocity, const Vec3& angular_velocity) {
  Body& body = *impl_->bodies[handle];
  if (!body.is_dynamic()) return;
  impl_->active.wake(body);
  body.rigid.set_velocity(velocity, angular_velocity);
}

void World::add_impulse(BodyHandle handle, const Vec3& impulse, const Vec3& point) {
  Body& body = *impl_->bodies[handle];
  if (!body.is_dynamic()) return;
  impl_->active.wake(body);
  body.rigid.momentum += impulse;
  body.rigid.angular_momentum += (point - body.rigid.position).cross(impulse);
}

bool World::remove(ParticleSystemHandle system) {
  if (!impl_->systems.erase(system)) return false;
  impl_->particle_motion.forget(system);
  impl_->remove_dead_springs();
  return true;
}

bool World::remove(SpringHandle spring) {
  if (const Spring* s = impl_->springs.find(spring))
    for (const Attachment* end : {&s->def.a, &s->def.b})
      if (const auto* point = std::get_if<BodyPoint>(end)) impl_->active.wake(*impl_->bodies[point->body]);
  return impl_->springs.erase(spring);
}

uint64_t World::add_particle(ParticleSystemHandle system, const Particle& particle, Real elapsed) {
  assert(particle.mass > 0 && particle.radius > 0);
  ++impl_->born;
  return impl_->systems[system].add(particle, elapsed);
}

StepReport World::prewarm(Real from, Real to, const BeforeSubStep& before) {
  const bool goes_on = impl_->samplings == 0 && (impl_->now == 0 || impl_->now == from);
  if (!(from <= to && to <= 0) || !std::isfinite(from) || !goes_on)
    refuse("world", "prewarm goes from " + std::to_string(from) + " s to " + std::to_string(to) +
                        " s, allowed is from <= to <= 0, before the first step");
  return impl_->prewarm(from, to, before);
}

StepReport World::step(Real sampling_time, const BeforeSubStep& before) {
  return impl_->step(sampling_time, before);
}

Real World::time() const {
  return impl_->now;
}
const WorldDef& World::def() const {
  return impl_->def;
}
std::span<const MovedBody> World::moved() const {
  return impl_->moved;
}
const BodyDef& World::body_def(BodyHandle body) const {
  return impl_->bodies[body]->def;
}
const ParticleArrays& World::particles(ParticleSystemHandle system) const {
  return impl_->systems[system].arrays;
}
const ParticleSystemDef& World::particle_system_def(ParticleSystemHandle system) const {
  return impl_->systems[system].def;
}
std::span<const ParticleEvent> World::particle_events() const {
  return impl_->particle_motion.events();
}
Motion World::body_motion(BodyHandle body, Real time) const {
  return impl_->bodies[body]->motion(impl_->now, time);
}

BodyState World::body(BodyHandle handle) const {
  const Body& body = *impl_->bodies[handle];
  const RigidBody& rigid = body.rigid;
  if (body.def.motion == MotionType::dynamic)
    return {body.pose, rigid.position, rigid.velocity(), rigid.angular_velocity(), rigid.angular_momentum,
            rigid.mass};
  const Motion motion = body.motion(impl_->now, impl_->now);
  const Vec3 centre = body.def.centre   ? *body.def.centre
                      : body.solid.mesh ? body.solid.mesh->mass.centre
                      : std::holds_alternative<Plane>(body.def.shape)
                          ? Vec3(Vec3::Zero())
                          : mass_properties(body.def.shape).centre;
  const Vec3 arm = body.pose.vector_to_world(centre);
  return {body.pose,
          body.pose.position + arm,
          motion.velocity + motion.angular_velocity.cross(arm),
          motion.angular_velocity,
          Vec3::Zero(),
          0};
}

void World::for_each_body(const std::function<void(BodyHandle)>& f) const {
  impl_->bodies.for_each([&](BodyHandle handle, const auto&) { f(handle); });
}

void World::for_each_particle_system(const std::function<void(ParticleSystemHandle)>& f) const {
  impl_->systems.for_each([&](ParticleSystemHandle handle, const auto&) { f(handle); });
}

std::vector<ContactState> World::contacts() const {
  std::vector<ContactState> states;
  impl_->contacts.for_each([&](const ContactPair& pair) {
    for (const PlacedManifold& m : pair.manifolds())
      for (uint32_t k = 0; k < m.manifold.count; ++k) {
        const ContactPoint& p = m.manifold.points[k];
        if (p.separation > kTouching && m.forces[k].now.x() == 0) continue;
        const Vec3& f = m.forces[k].now;
        states.push_back({pair.a().handle, pair.b().handle, (p.on_a + p.on_b) / 2, m.frame.n,
                          f.x() * m.frame.n + f.y() * m.frame.t + f.z() * m.frame.k, p.separation});
      }
  });
  return states;
}

std::vector<BodyOverlap> World::overlaps(Real least) const {
  impl_->update_joints();  // joined bodies do not collide with each other
  BroadPhase boxes;
  impl_->bodies.for_each([&](BodyHandle handle, const auto& body) {
    if (body->collides()) boxes.insert(handle.index, bounds(body->solid, body->pose), !body->is_dynamic());
  });
  std::vector<BodyOverlap> found;
  for (const IndexPair& pair : boxes.pairs()) {
    Body* a = impl_->bodies[impl_->bodies.at_slot(pair.a)].get();
    Body* b = impl_->bodies[impl_->bodies.at_slot(pair.b)].get();
    if (impl_->joint_groups.is_collision_disabled(*a, *b)) continue;
    if (a->collision_shape().is_plane()) std::swap(a, b);
    const Pose a_from_b{a->pose.point_to_body(b->pose.position),
                        a->pose.orientation.conjugate() * b->pose.orientation};
    PairCache none;
    // The tree search ignores pairs beyond a limit. Touching bodies have the bound 0, so the limit must be
    // above 0.
    const auto s =
        separation(a->collision_shape(), b->collision_shape(), a_from_b, none, DistanceMethod::gjk, least);
    if (!s || -s->distance <= least) continue;
    if (!a->is_dynamic()) std::swap(a, b);
    found.push_back({a->handle, b->handle, -s->distance});
  }
  return found;
}

std::optional<uint32_t> World::island(BodyHandle handle) const {
  const Body& body = *impl_->bodies[handle];
  if (!body.is_dynamic()) return std::nullopt;
  return body.asleep ? static_cast<uint32_t>(impl_->islands.size()) + body.island : body.island;
}

bool World::is_asleep(BodyHandle body) const {
  return impl_->bodies[body]->asleep;
}

std::size_t World::body_count() const {
  return impl_->bodies.size();
}

std::size_t World::particle_count() const {
  std::size_t count = 0;
  impl_->systems.for_each([&](auto, const ParticleSystem& s) { count += s.arrays.size(); });
  return count;
}

Energy World::energy() const {
  Energy e;
  const Vec3& g = impl_->def.gravity;
  impl_->bodies.for_each([&](auto, const std::unique_ptr<Body>& body) {
    if (!body->is_dynamic()) return;
    const RigidBody& r = body->rigid;
    e.kinetic += r.momentum.squaredNorm() / (2 * r.mass) + r.angular_velocity().dot(r.angular_momentum) / 2;
    e.potential -= r.mass * g.dot(r.position);
  });
  impl_->systems.for_each([&](auto, const ParticleSystem& s) {
    for (std::size_t i = 0; i < s.arrays.size(); ++i) {
      e.kinetic += s.arrays.mass[i] * s.arrays.velocity[i].squaredNorm() / 2;
      if (s.def.rotates)
        e.kinetic += s.arrays.mass[i] / kBallTurning *
                     (s.arrays.radius[i] * s.arrays.angular_velocity[i]).squaredNorm() / 2;
      if (s.def.gravity) e.potential -= s.arrays.mass[i] * g.dot(s.arrays.position[i]);
    }
  });
  impl_->springs.for_each([&](auto, const Spring& s) {
    if (!impl_->acts(s)) return;
    const Real stretch = (impl_->position(s.def.a) - impl_->position(s.def.b)).norm() - s.rest_length;
    e.elastic += s.def.stiffness * stretch * stretch / 2;
  });
  impl_->joints.for_each(
      [&](auto, const std::unique_ptr<Joint>& joint) { e.elastic += spring_energy(*joint, impl_->now); });
  e.potential += pair_energy(*impl_, impl_->now);
  impl_->cloths.for_each([&](auto, const std::unique_ptr<Cloth>& cloth) {
    if (cloth->absent) return;
    for (std::size_t i = 0; i < cloth->points.size(); ++i) {
      e.kinetic += cloth->masses[i] * cloth->velocities[i].squaredNorm() / 2;
      e.potential -= cloth->masses[i] * g.dot(cloth->points[i]);
    }
    e.elastic += elastic_energy(*cloth);
  });
  return e;
}

}  // namespace offstage::sim
