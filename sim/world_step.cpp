/// The loop of a sampling step (physics E4-E6), as far as it goes without resolving contacts between bodies.

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/collision/overlap.h"
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

/// Least edge of a solid's box in its own frame: what a fast body could pass through.
Real thickness(const Solid& solid) {
  if (std::holds_alternative<Plane>(*solid.shape)) return std::numeric_limits<Real>::infinity();
  return bounds(solid, Pose{}).sizes().minCoeff();
}

/// Pose of a body at a share of the sub-step.
Pose between(const Body& body, Real share) {
  const Pose &a = body.before_substep, &b = body.pose;
  return {a.position + share * (b.position - a.position), a.orientation.slerp(share, b.orientation)};
}

/// Whether two bodies touch anywhere on their ways through the sub-step: looked at so often that neither can
/// pass the other in between, within a bounded number of looks.
bool touch_on_the_way(const Body& a, const Body& b) {
  constexpr int kMostLooks = 512;
  const auto turn = [](const Body& body) {
    const Real angle = body.before_substep.orientation.angularDistance(body.pose.orientation);
    return angle > 0 ? angle * reach(body.solid) : 0;
  };
  const Vec3 slip =
      (a.pose.position - a.before_substep.position) - (b.pose.position - b.before_substep.position);
  const Real travel = slip.norm() + turn(a) + turn(b),
             step = std::min(thickness(a.solid), thickness(b.solid)) / 2;
  const int looks =
      travel < step * kMostLooks ? std::max(1, static_cast<int>(std::ceil(travel / step))) : kMostLooks;
  for (int k = looks; k > 0; --k) {
    const Real share = static_cast<Real>(k) / looks;
    if (touching(a.solid, between(a, share), b.solid, between(b, share))) return true;
  }
  return false;
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
  find_contacts(end, report);
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
  if (fixed_changed) fixed_owners.clear();
  moving_owners.clear();
  bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
    if (!body->def.collides) return;
    const auto add = [&](std::vector<Obstacle>& obstacles, std::vector<BodyHandle>& owners,
                         const Pose& from) {
      obstacles.emplace_back(body->solid, from, body->pose, h, body->def.restitution, body->def.friction);
      owners.push_back(handle);
    };
    if (body->can_move())
      add(moving, moving_owners, body->before_substep);
    else if (fixed_changed)
      add(fixed, fixed_owners, body->pose);
  });
  moving_obstacles = Obstacles(std::move(moving));
  if (fixed_changed) fixed_obstacles = Obstacles(std::move(fixed));
  fixed_changed = false;
}

/// Reports each pair with a dynamic body that touches during the sub-step, once per step.
void World::Impl::find_contacts(Real time, StepReport& report) {
  const auto test = [&](BodyHandle a, BodyHandle b) {
    if (a == b) return;
    if (b < a) std::swap(a, b);
    const auto known = [&](const UnresolvedContact& c) { return c.a == a && c.b == b; };
    if (std::any_of(report.unresolved.begin(), report.unresolved.end(), known)) return;
    if (touch_on_the_way(*bodies[a], *bodies[b])) report.unresolved.push_back({a, b, time});
  };
  for (std::size_t i = 0; i < moving_owners.size(); ++i) {
    const BodyHandle self = moving_owners[i];
    const Body& body = *bodies[self];
    if (!body.is_dynamic()) continue;
    const Aabb box = bounds(body.solid, body.pose).merged(bounds(body.solid, body.before_substep));
    for (const auto& [obstacles, owners] :
         {std::pair(&fixed_obstacles, &fixed_owners), std::pair(&moving_obstacles, &moving_owners)}) {
      const auto test_owner = [&, &them = *owners](uint32_t k) { test(self, them[k]); };
      obstacles->for_each_plane(test_owner);
      obstacles->near_box(box, test_owner);
    }
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
