/// The loop of a sampling step (physics E4-E6).

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/core/parallel_loop.h"
#include "sim/world/coupled_system.h"
#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

constexpr Real kMaxSubsteps = 1e6;
constexpr std::size_t kWorthThreads = 200;

/// Whether the state and the velocities that follow from it are finite.
bool is_finite(const RigidBody& b) {
  return b.position.allFinite() && b.orientation.coeffs().allFinite() && b.velocity().allFinite() &&
         b.angular_velocity().allFinite() && b.angular_momentum.allFinite();
}

bool same(const Pose& a, const Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace

uint32_t substep_count(Real duration, Real longest) {
  const Real ratio = duration / longest;
  return static_cast<uint32_t>(std::clamp(std::ceil(ratio * (1 - 1e-12)), 1.0, kMaxSubsteps));
}

StepReport World::Impl::step(Real sampling, const BeforeSubStep& before) {
  assert(sampling > 0 && std::isfinite(sampling));
  StepReport report;
  if (!(sampling > 0) || !std::isfinite(sampling)) return report;
  if (sampling != sampling_time) {
    base_time = now;
    sampling_time = sampling;
    samplings = 0;
  }
  const auto at = [&](Real part) { return base_time + (static_cast<Real>(samplings) + part) * sampling; };

  update_lists();
  stepped.assign(awake.begin(), awake.end());
  stepped.insert(stepped.end(), kinematic.begin(), kinematic.end());
  for_each_index(stepped.size(), [&](std::size_t i) { stepped[i]->before_step = stepped[i]->pose; });
  begin_cloths();
  report.substeps = substep_count(sampling, def.max_step);
  for (uint32_t i = 0; i < report.substeps; ++i) {
    const Real start = now, end = at(static_cast<Real>(i + 1) / report.substeps);
    if (before) before(start, end);
    substep(start, end, report);
    now = end;
  }
  ++samplings;
  report.particles_born = std::exchange(born, 0);
  report.bodies_woken = std::exchange(bodies_woken, 0);
  report.bodies_put_to_sleep = std::exchange(bodies_put_to_sleep, 0);
  report_cloths(report);
  collect_moved();
  return report;
}

void World::Impl::substep(Real start, Real end, StepReport& report) {
  const Real h = end - start;
  ++substeps;
  update_presence(start);
  wake_pushed(start);
  explode(start, end);
  update_articulations();
  update_lists();
  begin_bodies(start, end);
  motions.clear();
  if (awake.empty() && kinematic.empty() && springs.empty() && systems.empty()) {
    islands.clear();
    active_pairs.clear();
    pairs_changed = true;
    count_contacts(report);
    return step_cloths(start, h);
  }
  // For few bodies a task arena of several threads would cost more than it gains, in particular on a busy
  // machine.
  const auto bodies_move = [&] { move_bodies(start, h, report); };
  if (awake.size() < kWorthThreads && !has_pair_forces())
    serial.execute(bodies_move);
  else
    bodies_move();
  for (const auto& m : motions) {
    report.integration.add(m->report());
    joint_tally.add(m->joint_tally());
  }
  report.joint_error = std::max(report.joint_error, joint_tally.error);
  report.joints_unsolved += joint_tally.unsolved;
  joint_tally = {};
  for (const auto& articulation : articulations) articulation->count_turns(end);
  break_joints(h, report);

  if (!systems.empty()) {
    update_obstacles(h);
    step_particles(start, h, *motions.front(), report);
  }
  step_cloths(start, h);
}

/// Moves all bodies through a sub-step, with their contacts and impacts.
void World::Impl::move_bodies(Real start, Real h, StepReport& report) {
  move_all(start, h);
  if (!awake.empty() || (!kinematic.empty() && asleep > 0)) {
    do update_pairs(h);
    while (!wake_touched(start, h).empty());
    find_moving_islands(may_touch);
    solve_islands(start, h, report);
    resolve_impacts(start, h, report);
  } else {
    // Islands of the last sub-step with awake bodies must not fall asleep again.
    islands.clear();
    active_pairs.clear();
    pairs_changed = true;
  }
  for (const std::vector<Body*>* moving : {&awake, &kinematic})
    for (const std::size_t i :
         indices_where(moving->size(), [&](std::size_t k) { return !is_within_bounds(*(*moving)[k]); }))
      retire(*(*moving)[i], report);
  count_contacts(report);
  put_to_sleep(start, h);
}

/// Begins a sub-step for every moving body; kinematic bodies are moved to its end.
void World::Impl::begin_bodies(Real start, Real end) {
  for_each_interval(awake, [&](std::size_t i) {
    awake[i]->before_substep = awake[i]->pose;
    awake[i]->begin_interval(0);
  });
  begin_kinematic(start, end);
}

void World::Impl::begin_kinematic(Real start, Real end) {
  for (Body* body : kinematic) {
    const Motion motion = body->def.track.at(end, body->def.pose);
    if (body->def.track.jumps(start, end)) {
      // The body jumps to the new pose: nothing is swept along in between.
      wake_neighbours(*body);
      body->pose = motion.pose;
    }
    body->before_substep = body->pose;
    body->begin_interval(0);
    body->drive_to(motion);
  }
}

/// Applies the explosions of the sub-step at its start.
void World::Impl::explode(Real start, Real end) {
  force_defs.for_each([&](ForceHandle, const ForceDef& def_) {
    if (!def_.explodes(start, end)) return;
    const Explosion& explosion = std::get<Explosion>(def_.effect);
    bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
      if (!body->is_dynamic()) return;
      if (!def_.acts_on(handle)) return;
      const Wrench impact = impulse(explosion, body->solid, body->pose, body->rigid.position);
      if (impact.force == Vec3::Zero() && impact.torque == Vec3::Zero()) return;
      wake(*body);
      body->rigid.momentum += impact.force;
      body->rigid.angular_momentum += impact.torque;
    });
    systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
      if (!def_.acts_on(handle)) return;
      ParticleArrays& p = system.arrays;
      for (std::size_t i = 0; i < p.size(); ++i)
        if (system.whole_step(i)) p.velocity[i] += impulse(explosion, p.position[i]) / p.mass[i];
    });
    cloths.for_each([&](ClothHandle handle, const std::unique_ptr<Cloth>& cloth) {
      if (!def_.acts_on(handle)) return;
      // Each point gets its share of the impulse on the whole cloth, by mass.
      const Real total = std::accumulate(cloth->masses.begin(), cloth->masses.end(), 0.0);
      for (std::size_t i = 0; i < cloth->points.size(); ++i)
        cloth->velocities[i] += impulse(explosion, cloth->points[i]) / total;
    });
  });
}

std::vector<const ForceDef*> World::Impl::active_forces() const {
  std::vector<const ForceDef*> active;
  force_defs.for_each([&](ForceHandle, const ForceDef& f) { active.push_back(&f); });
  return active;
}

/// Moves all awake bodies, and the particles held by springs, through the sub-step without contacts.
void World::Impl::move_all(Real start, Real h) {
  motions.push_back(std::make_unique<CoupledSystem>(*this, active_forces()));
  CoupledSystem& motion = *motions.back();
  motion.save();
  motion.step(integrator(def.integrator), start, h, def.integration_error);
  for_each_index(awake.size(), [&](std::size_t i) { awake[i]->pose = awake[i]->rigid.pose(); });
}

/// The same for some bodies and the objects connected to them, over `duration` from `from` on.
CoupledSystem& World::Impl::move_some(std::span<Body* const> group, Real start, Real from, Real duration) {
  motions.push_back(std::make_unique<CoupledSystem>(*this, group, active_forces()));
  CoupledSystem& motion = *motions.back();
  motion.save();
  motion.step(integrator(def.integrator), start + from, duration, def.integration_error);
  for (Body* body : group) body->pose = body->rigid.pose();
  return motion;
}

bool World::Impl::is_within_bounds(const Body& body) const {
  if (!body.is_dynamic()) return def.bounds.contains(body.pose.position);
  return is_finite(body.rigid) && def.bounds.contains(body.rigid.position);
}

/// Freezes a body that left the world's bounds, or whose state is not finite; the latter at its last finite
/// state.
void World::Impl::retire(Body& body, StepReport& report) {
  if (body.is_dynamic() && !is_finite(body.rigid)) {
    if (report.finite) {
      const RigidBody& b = body.rigid;
      report.non_finite = {body.def.name, 0,          body.before_substep.position,
                           Vec3::Zero(),  b.position, b.momentum / b.mass};
    }
    report.finite = false;
    body.pose = body.before_substep;
    body.rigid.place(body.pose);
  }
  body.rigid.momentum.setZero();
  body.rigid.angular_momentum.setZero();
  body.type = MotionType::static_body;
  fixed_changed = lists_changed = joints_changed = true;
  report.bodies_retired.push_back(body.handle);
}

/// The body as an obstacle that moves through the sub-step of length h.
Obstacle World::Impl::swept_obstacle(const Body& body, Real h) const {
  const Pose& from = body.can_move() ? body.before_substep : body.pose;
  Obstacle o(body.solid, from, body.pose, h, body.def.restitution, body.def.friction);
  o.body = body.handle.index;
  if (body.def.cross_friction >= 0 && body.def.friction > 0) {
    o.friction_axis = body.def.friction_axis;
    o.cross_friction = std::sqrt(body.def.cross_friction / body.def.friction);
  }
  if (!body.is_dynamic() || prewarming) return o;
  const RigidBody& rigid = body.rigid;
  const Mat3 axes = rigid.orientation.toRotationMatrix();
  o.inverse_mass = 1 / rigid.mass;
  o.inverse_inertia = axes * rigid.inverse_inertia * axes.transpose();
  o.centre = rigid.centre;
  o.end_velocity = rigid.velocity();
  o.end_spin = rigid.angular_velocity();
  return o;
}

void World::Impl::update_obstacles(Real h) {
  std::vector<Obstacle> fixed, moving;
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (!body->collides()) return;
    if (body->can_move() && !(prewarming && body->is_dynamic()))
      moving.push_back(swept_obstacle(*body, h));
    else if (fixed_changed)
      fixed.push_back(swept_obstacle(*body, h));
  });
  moving_obstacles = Obstacles(std::move(moving));
  if (fixed_changed) fixed_obstacles = Obstacles(std::move(fixed));
  fixed_changed = false;
}

void World::Impl::step_particles(Real start, Real h, const CoupledSystem& coupled, StepReport& report) {
  for (const auto& articulation : articulations) articulation->begin_impulses(start + h);
  body_impulses.begin(links);
  const ParticleStage stage{start, h, fixed_obstacles, moving_obstacles, def.bounds, body_impulses};
  report.particle_lcp.add(collide_particles(stage, coupled));
  auto collided = particle_collisions.outcomes().begin();
  bool removed_any = false;
  particle_events.clear();
  systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
    if (waits(handle)) return;
    ParticleTally tally;
    if (system.hits_particles()) {
      tally = std::move(collided->tally);
      tally += system.end_step(stage, collided->touched, collided->trapped);
      ++collided;
    } else {
      tally = system.step(stage, forces(system), coupled.holds(system));
    }
    add_events(tally.events);
    report.particles_expired += tally.expired;
    report.particles_retired += tally.retired;
    report.particles_ejected += tally.ejected;
    report.particles_removed += tally.removed;
    report.particle_collisions += tally.collisions;
    report.truncated_sweeps += tally.truncated;
    removed_any |= tally.expired + tally.retired + tally.removed > 0;
    if (tally.lost && report.finite) {
      report.non_finite = *tally.lost;
      report.non_finite.object = system.def.name;
    }
    report.finite &= !tally.lost;
  });
  if (removed_any) remove_dead_springs();
  push_bodies(body_impulses.sums(), start + h);
}

void World::Impl::collect_moved() {
  moved.clear();
  const auto has_moved = [&](std::size_t i) { return !same(stepped[i]->pose, stepped[i]->before_step); };
  for (const std::size_t i : indices_where(stepped.size(), has_moved))
    moved.push_back({stepped[i]->handle, stepped[i]->pose});
  const auto in_order = [](const MovedBody& a, const MovedBody& b) { return a.body.index < b.body.index; };
  if (!std::is_sorted(moved.begin(), moved.end(), in_order)) std::sort(moved.begin(), moved.end(), in_order);
}

}  // namespace offstage::sim
