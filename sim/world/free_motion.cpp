#include "sim/world/free_motion.h"

#include <algorithm>

#include "sim/core/parallel_loop.h"
#include "sim/world/joint_groups.h"

namespace offstage::sim {

/// Finds the bodies on which springs, drag or fields act.
void FreeMotion::find_motion_forces(std::span<Body* const> awake) {
  const std::vector<const ForceDef*> active = world_.active_forces();
  for (Body* body : awake) {
    body->held.begin_substep(body->rigid);
    body->has_motion_forces =
        body->rigid.linear_drag > 0 || body->rigid.angular_drag > 0 ||
        std::ranges::any_of(active, [&](const ForceDef* force) { return force->acts_on(body->handle); });
  }
  world_.springs.for_each([&](SpringHandle, const Spring& spring) {
    for (const Attachment* end : {&spring.def.a, &spring.def.b})
      if (const auto* point = std::get_if<BodyPoint>(end); point && world_.acts(spring))
        world_.bodies[point->body]->has_motion_forces = true;
  });
}

void FreeMotion::move_all(std::span<Body* const> awake, Real start, Real h) {
  find_motion_forces(awake);
  systems_.push_back(std::make_unique<CoupledSystem>(world_, world_.active_forces()));
  CoupledSystem& system = *systems_.back();
  system.save();
  system.step(integrator(world_.def.integrator), start, h, world_.def.integration_error);
  for_each_index(awake.size(), [&](std::size_t i) { awake[i]->pose = awake[i]->rigid.pose(); });
}

CoupledSystem& FreeMotion::move_group(std::span<Body* const> group, Real start, Real from, Real duration) {
  systems_.push_back(std::make_unique<CoupledSystem>(world_, group, world_.active_forces()));
  CoupledSystem& system = *systems_.back();
  system.save();
  system.step(integrator(world_.def.integrator), start + from, duration, world_.def.integration_error);
  for (Body* body : group) body->pose = body->rigid.pose();
  return system;
}

void FreeMotion::count(StepReport& report) const {
  for (const auto& system : systems_) {
    report.integration.add(system->report());
    report.joints.add(system->joint_figures());
  }
}

}  // namespace offstage::sim
