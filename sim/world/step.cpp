/// The loop of a sampling step (physics E4-E6).

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/core/parallel_loop.h"
#include "sim/world/impact_stage.h"
#include "sim/world/moving_islands.h"
#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

constexpr Real kMaxSubsteps = 1e6;
/// Greatest number of parts of a sub-step (World::Impl::first_part()).
constexpr uint32_t kMaxParts = 32;
constexpr std::size_t kWorthThreads = 200;

/// Whether the state, and the velocities that are computed from it, are finite.
bool is_finite(const RigidBody& b) {
  return b.position.allFinite() && b.orientation.coeffs().allFinite() && b.velocity().allFinite() &&
         b.angular_velocity().allFinite() && b.angular_momentum.allFinite();
}

/// Returns the smallest number of equal sub-steps of a duration that are not longer than `longest`. A ratio
/// within rounding of an integer counts as that integer.
uint32_t substep_count(Real duration, Real longest) {
  const Real ratio = duration / longest;
  return static_cast<uint32_t>(std::clamp(std::ceil(ratio * (1 - 1e-12)), 1.0, kMaxSubsteps));
}

bool same(const Pose& a, const Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace

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

  active.update();
  active.begin_step();
  cloth_motion.begin_step();
  const uint32_t count = substep_count(sampling, def.max_step);
  for (uint32_t i = 0; i < count; ++i) {
    const Real end = at(static_cast<Real>(i + 1) / static_cast<Real>(count));
    for (uint32_t k = 0; k < kMaxParts && now < end; ++k) {
      const Real start = now, part = k + 1 < kMaxParts ? first_part(end - start) : end - start;
      const Real until = part < end - start ? start + part : end;
      if (before) before(start, until);
      substep(start, until, report);
      now = until;
      ++report.substeps;
    }
  }
  update_presence(now);  // afterwards the state contains exactly the objects that exist at its time
  ++samplings;
  report.particles.born = std::exchange(born, 0);
  active.count(report);
  cloth_motion.report(report);
  collect_moved();
  return report;
}

void World::Impl::substep(Real start, Real end, StepReport& report) {
  const Real h = end - start;
  substep_start = start;
  substep_end = end;
  update_presence(start);
  active.wake_pushed(start);
  explode(start, end);
  update_joints();
  active.update();
  wake_at_jumps(start, end);
  active.update();
  begin_bodies(start, end, report);
  const bool moves = !active.awake().empty() || !active.kinematic().empty() || !springs.empty() ||
                     !systems.empty() || reactions.has_loads();
  if (moves) {
    // With few bodies, several threads would cost more time than they save, in particular on a busy machine.
    const auto bodies_move = [&] { move_bodies(start, h, report); };
    if (active.awake().size() < kWorthThreads && !has_pair_forces())
      serial.execute(bodies_move);
    else
      bodies_move();
    free_motion.count(report);
    for (const auto& articulation : articulations) articulation->count_turns(end);
    joint_groups.break_overloaded(h, report);
  } else {
    islands.clear();
    contacts.clear();
    contacts.count(report);
    report.bodies.islands = 0;
  }
  if (!cloths.empty()) cloth_motion.step(start, h, contacts.pairs(), reactions, report);
  // Particles move last, so that they meet cloths and bodies on the paths of both.
  if (!systems.empty() || reactions.has_loads()) step_particles(start, h, free_motion.whole(), report);
}

/// Moves all bodies through a sub-step, with their contacts and impacts.
void World::Impl::move_bodies(Real start, Real h, StepReport& report) {
  for (const auto& articulation : articulations) articulation->begin_rebounds();
  free_motion.move_all(active.awake(), start, h);
  if (!active.awake().empty() || (!active.kinematic().empty() && active.asleep() > 0)) {
    do contacts.find(h);
    while (!contacts.wake_touched(free_motion, start, h).empty());
    find_moving_islands(*this, active.awake(), contacts.pairs(), may_touch, free_motion.whole(), islands);
    contact_solver.solve_all(islands, start, h, report);
    ImpactStage(*this, active, contacts, contact_solver, free_motion, islands, start, h, report).resolve();
  } else {
    // The islands of the last sub-step have no awake bodies any more; they must not fall asleep again.
    islands.clear();
    contacts.clear();
  }
  for (const std::span<Body* const> moving : {active.awake(), active.kinematic()})
    for (const std::size_t i :
         indices_where(moving.size(), [&](std::size_t k) { return !is_within_bounds(*moving[k]); }))
      retire(*moving[i], report);
  contacts.count(report);
  report.bodies.islands = static_cast<uint32_t>(islands.size());
  active.put_to_sleep(islands, start, h);
}

/// Moves the particles. They collide with bodies, cloths and each other, and push them.
void World::Impl::step_particles(Real start, Real h, const CoupledSystem& coupled, StepReport& report) {
  const Aabb particles = active.awake().empty() ? Aabb{} : particle_motion.colliding_bounds(h);
  if (particle_motion.step(start, h, coupled, reactions.loads(contacts.pairs(), particles, h), report))
    remove_dead_springs();
  reactions.apply_particles(particle_motion.impulses(), start + h, h, report);
}

/// Implements World::prewarm(): only particles move; dynamic bodies stand still, and kinematic bodies follow
/// their tracks.
StepReport World::Impl::prewarm(Real from, Real to, const BeforeSubStep& before) {
  StepReport report;
  particle_motion.begin_prewarm(now == 0);
  active.update();
  now = from;
  if (from == to && before) before(from, to);
  const CoupledSystem still(*this, std::span<Body* const>{});
  report.substeps = from < to ? substep_count(to - from, def.max_step) : 0;
  for (uint32_t i = 0; i < report.substeps; ++i) {
    const Real start = now, fraction = static_cast<Real>(i + 1) / static_cast<Real>(report.substeps);
    const Real end = i + 1 < report.substeps ? from + fraction * (to - from) : to;
    if (before) before(start, end);
    substep_start = start;
    substep_end = end;
    begin_kinematic(start, end);
    step_particles(start, end - start, still, report);
    now = end;
  }
  particle_motion.end_prewarm(to == 0);
  report.particles.born = std::exchange(born, 0);
  return report;
}

void World::Impl::update_joints() {
  if (joint_groups.update()) contacts.update_joint_groups();
}

/// Begins a sub-step for every moving body; kinematic bodies are moved to its end.
void World::Impl::begin_bodies(Real start, Real end, StepReport& report) {
  reactions.begin_substep();
  cloth_motion.begin_substep(start, end - start, reactions, report);
  const std::span<Body* const> awake = active.awake();
  for_each_interval(awake, [&](std::size_t i) {
    awake[i]->before_substep = awake[i]->pose;
    awake[i]->begin_interval(0);
  });
  begin_kinematic(start, end);
  free_motion.begin_substep();
}

/// Wakes the sleeping bodies beside those that jump at a key, at their old and their new places.
void World::Impl::wake_at_jumps(Real start, Real end) {
  if (active.asleep() == 0) return;
  for (Body* body : active.kinematic()) {
    if (!body->def.track.jumps(start, end)) continue;
    wake_neighbours(*body);
    wake_overlapped(*body, body->def.track.at(end, body->def.pose).pose);
  }
}

void World::Impl::begin_kinematic(Real start, Real end) {
  for (Body* body : active.kinematic()) {
    const auto at = [&](Real time) { return body->def.track.at(time, body->def.pose); };
    // The velocity may jump at a key. So the velocities are those just after the start and just before the
    // end. Otherwise the contacts of this sub-step would stop bodies for a motion that begins later.
    const Real inside = kInside * (end - start);
    Motion motion = at(end);
    const bool jumps = body->def.track.jumps(start, end);
    if (!jumps) {
      const Motion last = at(end - inside);
      motion.velocity = last.velocity;
      motion.angular_velocity = last.angular_velocity;
    }
    const Motion before = jumps ? motion : at(start + inside);
    if (jumps) {
      // The body jumps to the new pose, and sweeps nothing on the way.
      body->pose = motion.pose;
    }
    body->before_substep = body->pose;
    body->begin_interval(0);
    body->start_twist = {before.velocity, before.angular_velocity};
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
      active.wake(*body);
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
      // Each point gets a part of the impulse on the whole cloth, in proportion to its mass.
      const Real total = std::accumulate(cloth->masses.begin(), cloth->masses.end(), 0.0);
      for (std::size_t i = 0; i < cloth->points.size(); ++i)
        cloth->velocities[i] += impulse(explosion, cloth->points[i]) / total;
    });
  });
}

bool World::Impl::is_within_bounds(const Body& body) const {
  if (!body.is_dynamic()) return def.bounds.contains(body.pose.position);
  return is_finite(body.rigid) && def.bounds.contains(body.rigid.position);
}

/// Makes a body static that has left the world's bounds or whose state is not finite. A body whose state is
/// not finite gets its last finite pose.
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
  active.note_change();
  joint_groups.note_change();
  report.bodies_retired.push_back(body.handle);
}

void World::Impl::collect_moved() {
  moved.clear();
  const std::span<Body* const> stepped = active.stepped();
  const auto has_moved = [&](std::size_t i) { return !same(stepped[i]->pose, stepped[i]->before_step); };
  for (const std::size_t i : indices_where(stepped.size(), has_moved))
    moved.push_back({stepped[i]->handle, stepped[i]->pose});
  const auto in_order = [](const MovedBody& a, const MovedBody& b) { return a.body.index < b.body.index; };
  if (!std::is_sorted(moved.begin(), moved.end(), in_order)) std::sort(moved.begin(), moved.end(), in_order);
}

}  // namespace offstage::sim
