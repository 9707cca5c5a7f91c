#include "sim/world/coupled_group.h"

#include <algorithm>
#include <cmath>

#include "sim/articulation/joint_energy.h"

namespace offstage::sim {
namespace {

/// The motion of articulations is integrated in at most kMostPieces pieces. In a piece a link turns by at
/// most kTurn, the fastest swing advances its phase by at most kSwing, and a body spins by at most kSpin
/// [rad].
constexpr Real kTurn = 0.12, kSwing = 1, kSpin = 1, kMostPieces = 64;
/// A piece is halved in two cases: a joint error exceeds kGap [m], [rad], or the change of the kinetic energy
/// differs too much from the work of the forces. The accepted difference is the fraction kEnergyFraction of
/// the kinetic energy, plus kWorkFraction of the work and of the work that the forces would do on free bodies
/// at rest. The depth of the halvings and their number in a sub-step are bounded.
constexpr Real kGap = 1e-4, kEnergyFraction = 1e-4, kWorkFraction = 1e-2;
constexpr int kMostHalvings = 128, kDeepestHalving = 8;

}  // namespace

CoupledGroup::CoupledGroup(const WorldState& world, GroupMembers members, const BodyForces& forces)
    : forces_(forces), bodies_(std::move(members.bodies)) {
  for (ParticleSystem* system : members.systems) add_group(world, *system);
  x_.resize(particle_x(particles_));
  p_.resize(particle_p(particles_));
  BodyIndex index;
  for (std::size_t i = 0; i < bodies_.size(); ++i) index[bodies_[i]] = i;
  add_springs(world, members.springs, index);
  for (Articulation* a : members.articulations) add_articulation(*a, index);
  add_pair_forces(world);
}

void CoupledGroup::add_group(const WorldState& world, ParticleSystem& system) {
  Group group{&system, world.forces(system), {}, {}, particles_};
  for (std::size_t i = 0; i < system.arrays.size(); ++i)
    if (system.whole_step(i)) {
      group.members.push_back(i);
      group.mass.push_back(system.arrays.mass[i]);
    }
  particles_ += group.members.size();
  groups_.push_back(std::move(group));
}

/// Adds the forces between particles. New particles take part from their first whole sub-step on.
void CoupledGroup::add_pair_forces(const WorldState& world) {
  world.force_defs.for_each([&](ForceHandle, const ForceDef& def) {
    if (!def.is_pairwise() || !world.acts(def)) return;
    std::vector<PairMember> members;
    for (const Group& g : groups_) {
      if (!def.acts_on(g.system->handle)) continue;
      for (std::size_t k = 0; k < g.members.size(); ++k)
        members.push_back({g.offset + k, g.mass[k], g.system->arrays.charge[g.members[k]]});
    }
    if (!members.empty()) pair_forces_.add(def, std::move(members));
  });
}

bool CoupledGroup::holds(const ParticleSystem& system) const {
  return std::any_of(groups_.begin(), groups_.end(), [&](const Group& g) { return g.system == &system; });
}

void CoupledGroup::begin_substep() const {
  for (const Group& g : groups_) g.system->begin_coupled();
}

void CoupledGroup::add_springs(const WorldState& world, std::span<const Spring* const> springs,
                               const BodyIndex& index) {
  // A spring at a new particle acts from that particle's first whole sub-step on.
  const auto ready = [&](const Attachment& a) {
    const auto* p = std::get_if<ParticlePoint>(&a);
    if (!p) return true;
    const ParticleSystem& system = world.systems[p->system];
    const auto i = system.find(p->id);
    return i && system.whole_step(*i);
  };
  for (const Spring* spring : springs)
    if (const SpringDef& def = spring->def; ready(def.a) && ready(def.b))
      springs_.push_back({resolve(world, def.a, index), resolve(world, def.b, index), def.stiffness,
                          def.damping, spring->rest_length});
}

void CoupledGroup::add_articulation(Articulation& articulation, const BodyIndex& index) {
  Jointed jointed{&articulation, {}};
  for (const Body* body : articulation.bodies()) jointed.links.push_back(index.at(body));
  articulations_.push_back(std::move(jointed));
}

CoupledGroup::End CoupledGroup::resolve(const WorldState& world, const Attachment& a,
                                        const BodyIndex& index) const {
  if (const auto* w = std::get_if<WorldPoint>(&a)) return {.point = w->position};
  if (const auto* b = std::get_if<BodyPoint>(&a)) {
    const Body* body = world.bodies[b->body].get();
    if (body->is_awake()) {
      assert(index.contains(body) && "both ends of a spring must be in the same group");
      return {End::Kind::dynamic, b->position - body->rigid.centre, body, index.at(body)};
    }
    if (body->can_move()) return {End::Kind::kinematic, b->position, body};
    return {.point = body->pose.point_to_world(b->position)};
  }
  const auto& p = std::get<ParticlePoint>(a);
  const ParticleSystem& system = world.systems[p.system];
  const std::size_t i = *system.find(p.id);
  const Group& group =
      *std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.system == &system; });
  const auto member = std::lower_bound(group.members.begin(), group.members.end(), i) - group.members.begin();
  return {End::Kind::particle, Vec3::Zero(), nullptr, group.offset + static_cast<std::size_t>(member),
          system.arrays.mass[i]};
}

CoupledGroup::PointMotion CoupledGroup::motion(const End& end, Real t, std::span<const Real> x,
                                               std::span<const Real> p) const {
  switch (end.kind) {
    case End::Kind::still:
      break;
    case End::Kind::kinematic: {
      const Motion m = end.body->def.track.at(t, end.body->def.pose);
      const Vec3 arm = m.pose.vector_to_world(end.point);
      return {m.pose.position + arm, m.velocity + m.angular_velocity.cross(arm)};
    }
    case End::Kind::dynamic: {
      const RigidMotion m = stage(end.index, x, p).motion;
      const Vec3 arm = m.orientation * end.point;
      return {m.position + arm, m.velocity + m.angular_velocity.cross(arm)};
    }
    case End::Kind::particle:
      return {vec3(x, particle_x(end.index)), vec3(p, particle_p(end.index))};
  }
  return {end.point, Vec3::Zero()};
}

CoupledGroup::Pull CoupledGroup::pull(const ActiveSpring& s, Real t, std::span<const Real> x,
                                      std::span<const Real> p) const {
  const PointMotion a = motion(s.a, t, x, p), b = motion(s.b, t, x, p);
  const Vec3 d = a.position - b.position;
  const Real length = d.norm();
  if (length == 0) return {};
  const Vec3 along = d / length, velocity = a.velocity - b.velocity;
  return {along, length, s.stiffness * (length - s.rest_length) + s.damping * velocity.dot(along), velocity};
}

void CoupledGroup::apply(const End& end, const Vec3& force, std::span<const Real> x,
                         std::span<Real> dp) const {
  if (end.kind == End::Kind::dynamic) {
    const std::size_t at = kBodyP * end.index;
    const Eigen::Map<const Eigen::Vector4d> turn(&x[kBodyX * end.index + 3]);
    vec3(dp, at) += force;
    vec3(dp, at + 3) += (Quat(turn).normalized() * end.point).cross(force);
  } else if (end.kind == End::Kind::particle) {
    vec3(dp, particle_p(end.index)) += force / end.mass;
  }
}

void CoupledGroup::velocity(Real, std::span<const Real> x, std::span<const Real> p,
                            std::span<Real> dx) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) stage(i, x, p).velocity(dx.subspan(kBodyX * i, kBodyX));
  const auto particles = p.subspan(particle_p(0));
  std::copy(particles.begin(), particles.end(), dx.begin() + static_cast<std::ptrdiff_t>(particle_x(0)));
}

void CoupledGroup::force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const {
  set_free_forces(t, x, p, dp);
  for (const Jointed& j : articulations_) add_joint_forces(j, t, x, p, dp);
}

/// Computes in `dp` the forces that act between two kicks, except joint forces.
void CoupledGroup::set_free_forces(Real t, std::span<const Real> x, std::span<const Real> p,
                                   std::span<Real> dp) const {
  set_all_forces(t, x, p, dp);
  for (const Jointed& j : articulations_)
    if (j.articulation->has_springs())
      for (const std::size_t link : j.links) std::ranges::fill(dp.subspan(kBodyP * link, kBodyP), 0);
}

/// Computes in `dp` all forces except joint forces.
void CoupledGroup::set_all_forces(Real t, std::span<const Real> x, std::span<const Real> p,
                                  std::span<Real> dp) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    stage(i, x, p).force(forces_, t, dp.subspan(kBodyP * i, kBodyP));
  const auto particles_x = x.subspan(particle_x(0)), particles_v = p.subspan(particle_p(0));
  const auto particles_dv = dp.subspan(particle_p(0));
  for (const Group& g : groups_)
    g.forces.accelerate(t, g.part(particles_x), g.part(particles_v), g.mass, g.part(particles_dv));
  pair_forces_.accelerate(particles_x, particles_dv);
  for (const ActiveSpring& s : springs_) {
    const Pull f = pull(s, t, x, p);
    apply(s.a, -f.size * f.along, x, dp);
    apply(s.b, f.size * f.along, x, dp);
  }
}

/// Returns false unless the group consists of particles with forces between each other: forces of springs and
/// bodies depend on the velocities in other ways.
bool CoupledGroup::force_and_damping(Real t, std::span<const Real> x, std::span<const Real> p,
                                     std::span<Real> dp, std::span<Real> damping) const {
  if (!bodies_.empty() || !springs_.empty()) return false;
  for (const Group& g : groups_)
    FreeFlight(g.forces, g.mass).force_and_damping(t, g.part(x), g.part(p), g.part(dp), g.part(damping));
  pair_forces_.accelerate(x, dp);
  return true;
}

/// The links of an articulation, and the force and torque on each.
struct CoupledGroup::Links {
  std::vector<LinkMotion> motion;
  std::vector<LinkMobility> mobility;
  std::vector<Vec6> forces;
};

CoupledGroup::Links CoupledGroup::links(const Jointed& jointed, std::span<const Real> x,
                                        std::span<const Real> p, std::span<const Real> dp) const {
  const std::size_t count = jointed.links.size();
  Links links{std::vector<LinkMotion>(count), std::vector<LinkMobility>(count), std::vector<Vec6>(count)};
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = jointed.links[k];
    const RigidStage s = stage(i, x, p);
    const Mat3 axes = s.motion.orientation.toRotationMatrix();
    links.motion[k] = {s.motion.position, axes, s.motion.velocity, s.motion.angular_velocity};
    links.mobility[k] = {1 / s.body.mass, axes * s.body.inverse_inertia * axes.transpose()};
    links.forces[k] << vec3(dp, kBodyP * i), vec3(dp, kBodyP * i + 3);
  }
  return links;
}

void CoupledGroup::add_joint_forces(const Jointed& jointed, Real t, std::span<const Real> x,
                                    std::span<const Real> p, std::span<Real> dp) const {
  Links of = links(jointed, x, p, dp);
  jointed.articulation->add_forces(t, of.motion, of.mobility, of.forces);
  for (std::size_t k = 0; k < of.forces.size(); ++k) {
    const std::size_t at = kBodyP * jointed.links[k];
    vec3(dp, at) = of.forces[k].head<3>();
    vec3(dp, at + 3) = of.forces[k].tail<3>();
  }
}

/// Changes the velocities of links with springs by all forces from t to t + h. Until the next kick they move
/// without forces (physics A8).
void CoupledGroup::kick(Real t, Real h, IntegratorWorkspace& work) {
  work.dp.resize(p_.size());
  set_all_forces(t, x_, p_, work.dp);
  for (const Jointed& j : articulations_) {
    if (!j.articulation->has_springs()) continue;
    Links of = links(j, x_, p_, work.dp);
    j.articulation->kick(t, h, of.motion, of.mobility, of.forces);
    for (std::size_t k = 0; k < of.forces.size(); ++k) {
      const std::span<Real> p(p_);
      const std::size_t at = kBodyP * j.links[k];
      vec3(p, at) += h * of.forces[k].head<3>();
      vec3(p, at + 3) += h * of.forces[k].tail<3>();
    }
  }
}

/// Returns an upper bound of the stiffness of the forces on the members, per mass. Each object has the
/// damping of its own drag and of the springs at it. A spring moves at most with the sum of both its ends:
/// with the damping forces C (A v) of all springs and the inverse masses M, no eigenvalue of M A^T C A, which
/// is a sum over objects, exceeds the greatest sum that a spring meets.
Stiffness CoupledGroup::stiffness(Real t) const {
  struct Damping {
    Mat3 linear = Mat3::Zero();  // [kg/s]
    Real angular = 0;            // [kg m^2/s]
  };
  std::vector<Damping> bodies(bodies_.size()), particles(particles_);
  const auto damping_at = [&](const End& e) {
    return e.kind == End::Kind::particle ? &particles[e.index] : e.is_moved() ? &bodies[e.index] : nullptr;
  };
  for (const ActiveSpring& s : springs_) {
    if (s.damping == 0) continue;
    const Vec3 along = pull(s, t, x_, p_).along;
    for (const End* end : {&s.a, &s.b}) {
      Damping* at = damping_at(*end);
      if (!at) continue;
      at->linear += s.damping * along * along.transpose();
      if (end->kind == End::Kind::dynamic)
        at->angular += s.damping * (end->body->rigid.orientation * end->point).cross(along).squaredNorm();
    }
  }
  Stiffness most;
  std::vector<Real> body_rates, particle_rates;
  const auto add = [&](const Stiffness& own, Real by_springs, std::vector<Real>& rates) {
    rates.push_back(own.by_velocity + by_springs);
    most.by_position = std::max(most.by_position, own.by_position);
    most.by_velocity = std::max(most.by_velocity, rates.back());
  };
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidBody& body = bodies_[i]->rigid;
    add(sim::stiffness(body, forces_),
        bodies[i].linear.norm() / body.mass + bodies[i].angular * body.inverse_inertia.norm(), body_rates);
  }
  for (const Group& g : groups_) {
    const Stiffness own = g.forces.stiffness();
    for (std::size_t k = 0; k < g.mass.size(); ++k)
      add(1 / g.mass[k] * own, particles[g.offset + k].linear.norm() / g.mass[k], particle_rates);
  }
  for (const ActiveSpring& s : springs_) {
    Real sum = 0;
    for (const End* end : {&s.a, &s.b})
      if (end->is_moved())
        sum += end->kind == End::Kind::particle ? particle_rates[end->index] : body_rates[end->index];
    if (s.damping > 0) most.by_velocity = std::max(most.by_velocity, sum);
  }
  return most;
}

/// Returns the number of kicks in a step. `damping`: greatest rate of damping [1/s]; a kick by explicit drag
/// covers a decay by a factor e.
Real CoupledGroup::kicks(Real h, Real damping) const {
  Real count = std::max(1.0, std::ceil(damping * h));
  for (const Jointed& j : articulations_)
    if (j.articulation->has_springs()) count = std::max(count, j.articulation->kicks_needed(h));
  return std::min(count, kMostPieces);
}

/// Returns the number of pieces into which a step is divided. No fixed-step integrator is accurate if bodies
/// turn, or swing, by much more than kTurn or kSwing in a step. Links under high tension swing like the
/// masses of a vibrating string. Drag of the rate `damping` [1/s] is integrated explicitly while the pieces
/// allow it, because the implicit method does not know the derivatives of joint forces.
Real CoupledGroup::pieces(Real h, Real damping) const {
  Real fastest = 0, tightest = 0, spin = 0;
  for (const Body* body : bodies_) spin = std::max(spin, greatest_spin(body->rigid));
  for (const Jointed& j : articulations_) {
    for (const Body* body : j.articulation->bodies())
      fastest = std::max(fastest, body->rigid.angular_velocity().norm());
    if (!j.articulation->has_springs()) tightest = std::max(tightest, j.articulation->greatest_frequency());
  }
  return std::clamp(std::ceil(std::max({fastest / kTurn, tightest / kSwing, spin / kSpin, damping}) * h), 1.0,
                    kMostPieces);
}

void CoupledGroup::load(std::span<Real> x, std::span<Real> p) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    sim::load(bodies_[i]->rigid, x.subspan(kBodyX * i, kBodyX), p.subspan(kBodyP * i, kBodyP));
  for (const Group& g : groups_)
    for (std::size_t k = 0; k < g.members.size(); ++k) {
      vec3(x, particle_x(g.offset + k)) = g.system->arrays.position[g.members[k]];
      vec3(p, particle_p(g.offset + k)) = g.system->arrays.velocity[g.members[k]];
    }
}

void CoupledGroup::store(std::span<const Real> x, std::span<const Real> p) {
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    sim::store(x.subspan(kBodyX * i, kBodyX), p.subspan(kBodyP * i, kBodyP), bodies_[i]->rigid);
  for (const Group& g : groups_)
    for (std::size_t k = 0; k < g.members.size(); ++k) {
      g.system->arrays.position[g.members[k]] = vec3(x, particle_x(g.offset + k));
      g.system->arrays.velocity[g.members[k]] = vec3(p, particle_p(g.offset + k));
    }
}

void CoupledGroup::step(const Integrator& integrator, Real t, Real h, IntegratorWorkspace& work) {
  for (const Jointed& j : articulations_) j.articulation->transmit_impulses(t, joint_figures_);
  load(x_, p_);
  // The next step is the shortest that an adaptive integrator found for any member. Only bodies store it, so
  // a group without bodies starts without one.
  work.next_step = 0;
  for (const Body* body : bodies_)
    if (const Real next = body->rigid.next_step; next > 0)
      work.next_step = work.next_step > 0 ? std::min(work.next_step, next) : next;
  const bool particles_only = bodies_.empty() && springs_.empty();
  const IntegratorKind of_particles =
      particles_only ? groups_.front().system->def.integrator : IntegratorKind::rk4;
  Stiffness stiff = stiffness(t);
  if (particles_only && of_particles == IntegratorKind::leapfrog)
    stiff.by_velocity = 0;  // stable for any drag
  const bool is_kicked =
      std::ranges::any_of(articulations_, [](const Jointed& j) { return j.articulation->has_springs(); });
  const Real kick_count = is_kicked ? kicks(h, stiff.by_velocity) : 1;
  for (const Jointed& j : articulations_) j.articulation->set_kicks(kick_count);
  const bool is_divided = !articulations_.empty() && !is_stable(integrator, stiff, h);
  const Real damping = is_divided ? stiff.by_velocity : 0;
  const Real each = std::ceil(pieces(h, damping) / kick_count), count = kick_count * each,
             duration = h / count;
  const Integrator& chosen =
      stable_integrator(particles_only ? sim::integrator(of_particles) : integrator, stiff, duration);
  int halvings = kMostHalvings;
  for (Real i = 0; i < count; ++i) {
    const Real begin = t + i * duration;
    if (is_kicked && std::fmod(i, each) == 0) kick(begin, h / kick_count, work);
    if (articulations_.empty())
      chosen.step(*this, begin, duration, x_, p_, work);
    else
      advance(chosen, begin, duration, 0, halvings, work);
  }
  for (Body* body : bodies_) body->rigid.next_step = work.next_step;
  store(x_, p_);
}

Real CoupledGroup::kinetic_energy() const {
  const std::span<const Real> x = x_, p = p_;
  Real sum = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidMotion m = stage(i, x, p).motion;
    sum += (m.velocity.dot(vec3(p, kBodyP * i)) + m.angular_velocity.dot(vec3(p, kBodyP * i + 3))) / 2;
  }
  for (const Group& g : groups_)
    for (std::size_t k = 0; k < g.members.size(); ++k)
      sum += g.mass[k] * vec3(p, particle_p(g.offset + k)).squaredNorm() / 2;
  return sum;
}

CoupledGroup::EnergyRate CoupledGroup::energy_rate(Real t, IntegratorWorkspace& work) const {
  const std::span<const Real> x = x_, p = p_;
  work.dp.resize(p.size());
  set_free_forces(t, x, p, work.dp);
  const std::span<const Real> dp = work.dp;
  EnergyRate sum;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidStage s = stage(i, x, p);
    const std::size_t at = kBodyP * i;
    const Vec3 force = vec3(dp, at), torque = vec3(dp, at + 3);
    const Vec3 turning = s.motion.orientation.conjugate() * torque;  // in body axes
    sum.kinetic += (s.motion.velocity.dot(vec3(p, at)) + s.motion.angular_velocity.dot(vec3(p, at + 3))) / 2;
    sum.power += s.motion.velocity.dot(force) + s.motion.angular_velocity.dot(torque);
    sum.from_rest += (force.squaredNorm() / s.body.mass + turning.dot(s.body.inverse_inertia * turning)) / 2;
  }
  for (const Group& g : groups_)
    for (std::size_t k = 0; k < g.members.size(); ++k) {
      const Vec3 velocity = vec3(p, particle_p(g.offset + k)),
                 acceleration = vec3(dp, particle_p(g.offset + k));
      sum.kinetic += g.mass[k] * velocity.squaredNorm() / 2;
      sum.power += g.mass[k] * velocity.dot(acceleration);
      sum.from_rest += g.mass[k] * acceleration.squaredNorm() / 2;
    }
  return sum;
}

/// Advances by a piece from t to t + h and projects the joints. Joints can make a link rotate much faster
/// than the initial speeds suggest: a light link flips if the axes of a universal joint become coplanar with
/// its arm. Then the energy differs from the work of the forces, and the piece is halved. If halving does not
/// help, the links are slowed down until no energy is gained.
void CoupledGroup::advance(const Integrator& integrator, Real t, Real h, int depth, int& halvings,
                           IntegratorWorkspace& work) {
  const std::vector<Real> x = x_, p = p_;
  for (const Jointed& j : articulations_) j.articulation->begin_motion(t, h);
  const EnergyRate before = energy_rate(t, work);
  integrator.step(*this, t, h, x_, p_, work);
  const EnergyRate after = energy_rate(t + h, work);
  store(x_, p_);
  Real gap = 0;
  // Kinematic links do work through the joints, and first-order methods do not conserve energy.
  bool keeps_energy = integrator.order() > 1;
  for (const Jointed& j : articulations_) {
    gap = std::max(gap, joint_gap(*j.articulation, t + h));
    keeps_energy &= !has_kinematic_end(*j.articulation);
  }
  const Real done = h / 2 * (before.power + after.power);
  const Real allowed =
      kEnergyFraction * before.kinetic + kWorkFraction * h *
                                             (std::max(std::abs(before.power), std::abs(after.power)) +
                                              h * std::max(before.from_rest, after.from_rest));
  const bool is_finite = after.kinetic <= kInfinity;
  const bool follows =
      gap <= kGap && (!keeps_energy || std::abs(after.kinetic - before.kinetic - done) <= allowed);
  const bool may_halve = depth < kDeepestHalving && halvings > 0;
  if (!is_finite || (!follows && may_halve)) {
    x_ = x;
    p_ = p;
    store(x_, p_);
    if (may_halve) {
      --halvings;
      advance(integrator, t, h / 2, depth + 1, halvings, work);
      return advance(integrator, t + h / 2, h / 2, depth + 1, halvings, work);
    }
    ++joint_figures_.unsolved;  // the members do not move in this piece
  }
  for (const Jointed& j : articulations_) {
    // The projection of the joints changes the angular momentum, which is restored. (After contacts the
    // change is wanted: that projection reverses displacements by the contacts.)
    const bool is_free = !is_held(*j.articulation);
    const CommonMotion common = is_free ? common_motion(j.articulation->bodies()) : CommonMotion{};
    j.articulation->settle(t + h, joint_figures_);
    if (is_free) keep_angular_momentum(j.articulation->bodies(), common);
  }
  load(x_, p_);
  if (keeps_energy) limit_energy(before.kinetic + std::max(done, 0.0) + allowed);
}

/// Scales the relative velocities of the links of each articulation until the kinetic energy is at most
/// `most`.
void CoupledGroup::limit_energy(Real most) {
  const Real excess = kinetic_energy() - most;
  if (!(excess > 0)) return;
  Real internal = 0;
  for (const Jointed& j : articulations_) internal += internal_energy(*j.articulation);
  const Real fraction = std::sqrt(std::max(0.0, 1 - excess / internal));
  for (const Jointed& j : articulations_) slow_down(*j.articulation, fraction);
  load(x_, p_);
  ++joint_figures_.unsolved;
}

void CoupledGroup::save() {
  saved_x_.resize(x_.size());
  saved_p_.resize(p_.size());
  load(saved_x_, saved_p_);
  saved_steps_.clear();
  for (const Body* body : bodies_) saved_steps_.push_back(body->rigid.next_step);
}

void CoupledGroup::restore() {
  store(saved_x_, saved_p_);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    RigidBody& body = bodies_[i]->rigid;
    body.next_step = saved_steps_[i];
    // The exact bits are restored, because another normalization might change the last one.
    body.orientation.coeffs() = Eigen::Map<const Eigen::Vector4d>(&saved_x_[kBodyX * i + 3]);
  }
}

}  // namespace offstage::sim
