/// The loop of a sampling step (physics E4-E6), as far as it goes without resolving contacts between bodies.

#include <algorithm>
#include <cmath>

#include "sim/collision/narrow_phase.h"
#include "sim/coupled_system.h"
#include "sim/world_impl.h"

namespace offstage::sim {
namespace {

constexpr Real kMaxSubsteps = 1e6;

/// The fewest equal sub-steps not longer than `longest`. Rounding of a ratio that is meant to be whole adds
/// none.
uint32_t substep_count(Real sampling_time, Real longest) {
  const Real ratio = sampling_time / longest;
  return static_cast<uint32_t>(std::clamp(std::ceil(ratio * (1 - 1e-12)), 1.0, kMaxSubsteps));
}

bool is_finite(const RigidBody& b) {
  return b.position.allFinite() && b.orientation.coeffs().allFinite() && b.momentum.allFinite() &&
         b.angular_momentum.allFinite();
}

/// How near bodies count as touching [m].
constexpr Real kTouch = 1e-6;

/// Box around all places of a body in the sub-step.
Aabb swept_bounds(const Body& body) {
  const PosePath path(body.before_substep, body.pose);
  Aabb box = bounds(body.solid, body.before_substep).merged(bounds(body.solid, body.pose));
  // A point leaves the chord of its path by no more than an eighth of its greatest acceleration.
  const Real bulge = path.turn() > 0 ? path.max_acceleration(reach(body.solid)) / 8 : 0;
  box.min().array() -= bulge + kTouch;
  box.max().array() += bulge + kTouch;
  return box;
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

  bodies.for_each([](BodyHandle, const std::unique_ptr<Body>& body) { body->before_step = body->pose; });
  report.substeps = substep_count(sampling, def.max_step);
  for (uint32_t i = 0; i < report.substeps; ++i) {
    const Real start = now, end = at(static_cast<Real>(i + 1) / report.substeps);
    if (before) before(start, end);
    substep(start, end, report);
    now = end;
  }
  ++samplings;
  report.particles_born = std::exchange(born, 0);
  collect_moved();
  return report;
}

void World::Impl::substep(Real start, Real end, StepReport& report) {
  const Real h = end - start;
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) { body->before_substep = body->pose; });

  CoupledSystem coupled(*this);
  coupled.step(integrator(def.integrator), start, h);
  bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
    if (!body->can_move()) return;
    body->pose = body->is_dynamic() ? body->rigid.pose() : body->def.track.at(end, body->def.pose).pose;
    keep_within_bounds(handle, *body, report);
  });

  update_obstacles(h);
  find_contacts(start, h, report);
  step_particles(start, h, coupled, report);
}

/// Freezes a body that left the world or lost its numbers; the latter where it last was.
void World::Impl::keep_within_bounds(BodyHandle handle, Body& body, StepReport& report) {
  const bool finite = !body.is_dynamic() || is_finite(body.rigid);
  if (!finite) {
    if (report.finite) {
      const RigidBody& b = body.rigid;
      report.non_finite = {body.def.name, 0,          body.before_substep.position,
                           Vec3::Zero(),  b.position, b.momentum / b.mass};
    }
    report.finite = false;
    body.pose = body.before_substep;
    body.rigid.place(body.pose);
  } else if (def.bounds.contains(body.is_dynamic() ? body.rigid.position : body.pose.position)) {
    return;
  }
  body.rigid.momentum.setZero();
  body.rigid.angular_momentum.setZero();
  body.frozen = true;
  fixed_changed = true;
  report.bodies_retired.push_back(handle);
}

void World::Impl::update_obstacles(Real h) {
  std::vector<Obstacle> fixed, moving;
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (!body->def.collides) return;
    const auto add = [&](std::vector<Obstacle>& obstacles, const Pose& from) {
      obstacles.emplace_back(body->solid, from, body->pose, h, body->def.restitution, body->def.friction);
    };
    if (body->can_move())
      add(moving, body->before_substep);
    else if (fixed_changed)
      add(fixed, body->pose);
  });
  moving_obstacles = Obstacles(std::move(moving));
  if (fixed_changed) fixed_obstacles = Obstacles(std::move(fixed));
  fixed_changed = false;
}

/// Reports each pair with a dynamic body that touches during the sub-step, once per step.
void World::Impl::find_contacts(Real start, Real h, StepReport& report) {
  bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
    if (body->def.collides && body->can_move()) broad_phase.move(handle.index, swept_bounds(*body));
  });
  for (const auto& [low, high] : broad_phase.pairs()) {
    const BodyHandle a = bodies.at_slot(low), b = bodies.at_slot(high);
    Body *first = bodies[a].get(), *second = bodies[b].get();
    if (!first->is_dynamic() && !second->is_dynamic()) continue;
    const auto known = [&](const UnresolvedContact& c) { return c.a == a && c.b == b; };
    if (std::any_of(report.unresolved.begin(), report.unresolved.end(), known)) continue;
    if (first->collision_shape().is_plane()) std::swap(first, second);
    const PosePath path(first->before_substep, first->pose), other_path(second->before_substep, second->pose);
    if (const auto impact = time_of_impact(MovingShape{first->collision_shape(), path},
                                           MovingShape{second->collision_shape(), other_path}, kTouch))
      report.unresolved.push_back({a, b, start + impact->share * h});
  }
}

void World::Impl::step_particles(Real start, Real h, const CoupledSystem& coupled, StepReport& report) {
  const ParticleStage stage{start, h, fixed_obstacles, moving_obstacles, def.bounds};
  bool removed_any = false;
  systems.for_each([&](ParticleSystemHandle, ParticleSystem& system) {
    const ParticleTally tally = system.step(stage, forces(system), coupled.holds(system));
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
}

void World::Impl::collect_moved() {
  moved.clear();
  bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
    if (!same(body->pose, body->before_step)) moved.push_back({handle, body->pose});
  });
}

}  // namespace offstage::sim
