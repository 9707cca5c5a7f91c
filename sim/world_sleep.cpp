/// Rest: groups of bodies that have hardly moved for a while are left alone until something happens to them.

#include <algorithm>

#include "sim/world_impl.h"

namespace offstage::sim {
namespace {

/// A body is quiet while none of its points moves faster than this [m/s], and goes to sleep after being quiet
/// so long [s], with all of its island.
constexpr Real kQuietSpeed = 0.01, kQuietTime = 0.5;
/// A sleeping body wakes when forces push it so differently from when it fell asleep that one of its points
/// would be accelerated by this [m/s^2].
constexpr Real kPush = 0.01;

Real fastest_point(const Body& body) {
  return body.rigid.velocity().norm() + body.rigid.angular_velocity().norm() * body.extent;
}

}  // namespace

void World::Impl::update_lists() {
  if (!std::exchange(lists_changed, false)) return;
  pairs_changed = true;
  awake.clear();
  kinematic.clear();
  asleep = 0;
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (body->is_awake()) awake.push_back(body.get());
    if (body->is_dynamic() && body->asleep) ++asleep;
    if (body->is_kinematic() && body->def.track.moves()) kinematic.push_back(body.get());
  });
}

/// Wakes a body and its sleeping group.
void World::Impl::wake(Body& body) {
  body.quiet_time = 0;
  if (!body.asleep) return;
  const auto group = sleeping.find(body.island);
  bodies_woken += group->second.size();
  for (Body* member : group->second) {
    member->asleep = false;
    member->quiet_time = 0;
    member->before_step = member->before_substep = member->pose;
    stepped.push_back(member);
  }
  sleeping.erase(group);
  lists_changed = fixed_changed = true;
}

void World::Impl::wake_all() {
  while (!sleeping.empty()) wake(*sleeping.begin()->second.front());
}

/// What the forces that may change in time do to a body at rest.
Wrench World::Impl::changing_push(const Body& body, Real time) const {
  const RigidMotion at_rest{body.rigid.position, body.rigid.orientation, Vec3::Zero(), Vec3::Zero()};
  Wrench sum;
  force_defs.for_each([&](ForceHandle, const ForceDef& force) {
    if (!force.changes() || !force.acts_on(body.handle)) return;
    const Wrench w = wrench(force, time, at_rest, body.rigid.centre, body.rigid.linear_drag);
    sum.force += w.force;
    sum.torque += w.torque;
  });
  return sum;
}

/// Wakes whom a force has begun to push, or no longer holds.
void World::Impl::wake_pushed(Real time) {
  bool changing = false;
  force_defs.for_each([&](ForceHandle, const ForceDef& force) { changing |= force.changes(); });
  if (!changing) return;
  std::vector<Body*> pushed;
  for (const auto& [number, group] : sleeping) {
    const auto woken = std::find_if(group.begin(), group.end(), [&](const Body* body) {
      const Wrench push = changing_push(*body, time);
      const Vec3 turn =
          body->rigid.angular_velocity(body->rigid.orientation, push.torque - body->rest_push.torque);
      return (push.force - body->rest_push.force).norm() / body->rigid.mass + turn.norm() * body->extent >
             kPush;
    });
    if (woken != group.end()) pushed.push_back(*woken);
  }
  for (Body* body : pushed) wake(*body);
}

void World::Impl::put_to_sleep(Real start, Real h) {
  if (!def.sleep) return;
  for (Body* body : awake) body->quiet_time = fastest_point(*body) < kQuietSpeed ? body->quiet_time + h : 0;
  for (const Island& island : islands) {
    if (island.bodies.empty()) continue;
    const bool quiet = std::all_of(island.bodies.begin(), island.bodies.end(), [](const Body* body) {
      return body->quiet_time >= kQuietTime && body->is_dynamic();
    });
    // Something pushes, or nothing holds: what hangs at the top of its flight is quiet for a moment only.
    if (!quiet || is_driven(island, start + h)) continue;
    const bool pushed = std::any_of(island.pairs.begin(), island.pairs.end(), [](const ContactPair* pair) {
      const Body& other = pair->a().is_awake() ? pair->b() : pair->a();
      return (other.is_kinematic() && other.def.track.moves()) || pair->surface().conveys;
    });
    if (pushed) continue;
    for (Body* body : island.bodies) {
      body->asleep = true;
      body->island = sleeping_groups;
      body->rest_push = changing_push(*body, start);
      body->rigid.momentum.setZero();
      body->rigid.angular_momentum.setZero();
    }
    bodies_put_to_sleep += island.bodies.size();
    sleeping.emplace(sleeping_groups++, island.bodies);
    lists_changed = fixed_changed = true;
  }
}

}  // namespace offstage::sim
