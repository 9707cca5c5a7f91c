/// Sleep: groups of bodies that have been almost at rest for some time are not simulated until something
/// disturbs them.

#include <algorithm>
#include <array>

#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

/// A body is quiet while no point of it moves faster than kQuietSpeed [m/s]. When all bodies of an island
/// have been quiet for kQuietTime [s], the island falls asleep.
constexpr Real kQuietSpeed = 0.01, kQuietTime = 0.5;
/// A sleeping body wakes when the forces on it have changed so much since it fell asleep that one of its
/// points would be accelerated by this [m/s^2].
constexpr Real kPush = 0.01;

Real fastest_point(const Body& body) {
  return body.rigid.velocity().norm() + body.rigid.angular_velocity().norm() * body.extent;
}

}  // namespace

/// Solvers and collision tests depend slightly on the order of bodies and contacts, and small differences
/// grow in a pile. Therefore the order does not depend on when bodies were added: they are ordered by their
/// initial positions from below, and bodies at the same position by their other properties.
void World::Impl::rank_bodies() {
  if (!std::exchange(ranks_changed, false)) return;
  constexpr std::size_t kKeys = 15;
  std::vector<std::pair<std::array<Real, kKeys>, Body*>> order;
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    const BodyDef& d = body->def;
    const Vec3 &p = d.pose.position, &v = d.velocity, &w = d.angular_velocity;
    const Eigen::Vector4d& q = d.pose.orientation.coeffs();
    const Real mass = body->is_dynamic() ? body->rigid.mass : 0;
    order.push_back({{p.y(), p.x(), p.z(), q[0], q[1], q[2], q[3], v.x(), v.y(), v.z(), w.x(), w.y(), w.z(),
                      mass, body->extent},
                     body.get()});
  });
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < order.size(); ++i) order[i].second->rank = static_cast<uint32_t>(i);
}

void World::Impl::update_lists() {
  if (!std::exchange(lists_changed, false)) return;
  rank_bodies();
  pairs_changed = true;
  awake.clear();
  kinematic.clear();
  asleep = 0;
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (body->is_awake()) awake.push_back(body.get());
    if (body->is_dynamic() && body->asleep) ++asleep;
    if (body->is_kinematic() && body->def.track.moves()) kinematic.push_back(body.get());
  });
  const auto by_rank = [](const Body* a, const Body* b) { return a->rank < b->rank; };
  std::sort(awake.begin(), awake.end(), by_rank);
  std::sort(kinematic.begin(), kinematic.end(), by_rank);
}

/// Wakes a body and all bodies of its sleeping group.
void World::Impl::wake(Body& body) {
  body.quiet_time = 0;
  if (!body.asleep) return;
  const auto group = sleeping.find(body.island);
  bodies_woken += group->second.size();
  for (Body* member : group->second) {
    member->asleep = false;
    member->quiet_time = 0;
    watched -= member->moving_springs.size();
    member->moving_springs.clear();
    member->rest_pins.reset();
    member->before_step = member->before_substep = member->pose;
    stepped.push_back(member);
  }
  sleeping.erase(group);
  lists_changed = fixed_changed = true;
}

void World::Impl::wake_all() {
  while (!sleeping.empty()) wake(*sleeping.begin()->second.front());
}

/// Stores for bodies that fall asleep the springs whose force can change later: those with the other end at a
/// kinematic body or a particle.
void World::Impl::watch_springs(std::span<Body* const> group) {
  const auto sleeper = [&](const Attachment& end) -> Body* {
    const auto* point = std::get_if<BodyPoint>(&end);
    Body* body = point ? bodies[point->body].get() : nullptr;
    return body && std::find(group.begin(), group.end(), body) != group.end() ? body : nullptr;
  };
  const auto moves = [&](const Attachment& end) {
    if (const auto* point = std::get_if<BodyPoint>(&end)) {
      const Body& body = *bodies[point->body];
      return body.is_kinematic() && body.def.track.moves();
    }
    return std::holds_alternative<ParticlePoint>(end);
  };
  springs.for_each([&](SpringHandle handle, const Spring& s) {
    if (!acts(s)) return;
    for (const auto& [own, other] : {std::pair(&s.def.a, &s.def.b), {&s.def.b, &s.def.a}})
      if (Body* body = moves(*other) ? sleeper(*own) : nullptr) {
        body->moving_springs.push_back(handle);
        ++watched;
      }
  });
}

/// Wrench of a spring on a sleeping body at one of its ends.
Wrench World::Impl::spring_push(const Spring& spring, const Body& body, Real time) const {
  const auto motion = [&](const Attachment& end) -> Motion {
    if (const auto* p = std::get_if<ParticlePoint>(&end)) {
      const ParticleSystem& system = systems[p->system];
      const std::size_t i = *system.find(p->id);
      return {{system.arrays.position[i]}, system.arrays.velocity[i]};
    }
    const BodyPoint& point = std::get<BodyPoint>(end);
    const Motion m = bodies[point.body]->motion(now, time);
    const Vec3 arm = m.pose.vector_to_world(point.position);
    return {{m.pose.position + arm}, m.velocity + m.angular_velocity.cross(arm)};
  };
  const auto* a = std::get_if<BodyPoint>(&spring.def.a);
  const bool is_a = a && a->body == body.handle;
  const Motion own = motion(is_a ? spring.def.a : spring.def.b),
               other = motion(is_a ? spring.def.b : spring.def.a);
  const Vec3 d = own.pose.position - other.pose.position;
  const Real length = d.norm();
  if (length == 0) return {};
  const Vec3 along = d / length;
  const Vec3 force = -(spring.def.stiffness * (length - spring.rest_length) +
                       spring.def.damping * (own.velocity - other.velocity).dot(along)) *
                     along;
  return {force, (own.pose.position - body.rigid.position).cross(force)};
}

/// Wrench on a body at rest by the forces that may change with time.
Wrench World::Impl::changing_push(const Body& body, Real time) const {
  const RigidMotion at_rest{body.rigid.position, body.rigid.orientation, Vec3::Zero(), Vec3::Zero()};
  Wrench sum;
  force_defs.for_each([&](ForceHandle, const ForceDef& force) {
    if (!force.changes() || !force.acts_on(body.handle)) return;
    const Wrench w = wrench(force, time, at_rest, body.rigid.centre, body.rigid.linear_drag);
    sum.force += w.force;
    sum.torque += w.torque;
  });
  for (const SpringHandle spring : body.moving_springs) sum += spring_push(springs[spring], body, time);
  return sum;
}

/// Whether a wrench differs so much from that at rest that it could move a sleeping body.
bool World::Impl::is_pushed(const Body& body, const Wrench& push, const Wrench& at_rest) const {
  const Vec3 turn = body.rigid.angular_velocity(body.rigid.orientation, push.torque - at_rest.torque);
  return (push.force - at_rest.force).norm() / body.rigid.mass + turn.norm() * body.extent > kPush;
}

/// Wakes the bodies that a force or a spring has begun to push, or does not support any more.
void World::Impl::wake_pushed(Real time) {
  bool changing = false;
  force_defs.for_each([&](ForceHandle, const ForceDef& force) { changing |= force.changes(); });
  if (!changing && watched == 0) return;
  std::vector<Body*> pushed;
  for (const auto& [number, group] : sleeping) {
    const auto woken = std::find_if(group.begin(), group.end(), [&](const Body* body) {
      return (changing || !body->moving_springs.empty()) &&
             is_pushed(*body, changing_push(*body, time), body->rest_push);
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
    // A body with changing or missing support is not at rest: at the top of its flight it is quiet only for a
    // moment.
    if (!quiet || is_driven(island, start + h)) continue;
    const bool pushed = std::any_of(island.pairs.begin(), island.pairs.end(), [](const ContactPair* pair) {
      const Body& other = pair->a().is_awake() ? pair->b() : pair->a();
      return (other.is_kinematic() && other.def.track.moves()) || pair->surface().conveys;
    });
    if (pushed) continue;
    watch_springs(island.bodies);
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
