#include "sim/world/active_bodies.h"

#include <algorithm>
#include <array>

#include "sim/world/joint_groups.h"

namespace offstage::sim {
namespace {

/// A body is quiet while no point of it moves faster than kQuietSpeed [m/s]. When all bodies of an island
/// have been quiet for kQuietTime [s], the island falls asleep.
constexpr Real kQuietSpeed = 0.01, kQuietTime = 0.5;
/// Bodies that overlap by more than this are moved apart and do not fall asleep [m].
constexpr Real kApart = 1e-3;
/// A sleeping body wakes when the forces on it have changed so much since it fell asleep that one of its
/// points would be accelerated by this [m/s^2].
constexpr Real kPush = 0.01;

Real fastest_point(const Body& body) {
  return body.rigid.velocity().norm() + body.rigid.angular_velocity().norm() * body.extent;
}

/// Whether the contacts of a pair move its bodies apart.
bool overlaps(const ContactPair& pair) {
  return std::ranges::any_of(pair.manifolds(), [](const PlacedManifold& m) {
    const std::span points(m.manifold.points.data(), m.manifold.count);
    return std::ranges::any_of(points, [](const ContactPoint& p) { return p.separation < -kApart; });
  });
}

/// Returns the wrench of a spring on a sleeping body. The body is at one end of the spring or at both.
Wrench spring_push(const WorldState& world, const Spring& spring, const Body& body, Real time) {
  const auto motion = [&](const Attachment& end) -> Motion {
    if (const auto* p = std::get_if<ParticlePoint>(&end)) {
      const ParticleSystem& system = world.systems[p->system];
      const std::size_t i = *system.find(p->id);
      return {{system.arrays.position[i]}, system.arrays.velocity[i]};
    }
    const BodyPoint& point = std::get<BodyPoint>(end);
    const Motion m = world.bodies[point.body]->motion(time, time);
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

}  // namespace

/// Ranks the bodies. Solvers and collision tests depend slightly on the order of bodies and contacts, and
/// small differences grow in a pile. Therefore the order does not depend on when bodies were added: it
/// follows their initial positions from below, and bodies at the same position are ordered by their other
/// properties.
void ActiveBodies::rank() {
  if (std::exchange(is_ranked_, true)) return;
  constexpr std::size_t kKeys = 15;
  std::vector<std::pair<std::array<Real, kKeys>, Body*>> order;
  world_.bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
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

void ActiveBodies::update() {
  if (std::exchange(is_current_, true)) return;
  rank();
  awake_.clear();
  kinematic_.clear();
  asleep_ = 0;
  world_.bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (body->is_awake()) awake_.push_back(body.get());
    if (body->is_dynamic() && body->asleep) ++asleep_;
    if (body->is_kinematic() && body->def.track.moves()) kinematic_.push_back(body.get());
  });
  const auto by_rank = [](const Body* a, const Body* b) { return a->rank < b->rank; };
  std::sort(awake_.begin(), awake_.end(), by_rank);
  std::sort(kinematic_.begin(), kinematic_.end(), by_rank);
}

void ActiveBodies::begin_step() {
  stepped_.assign(awake_.begin(), awake_.end());
  stepped_.insert(stepped_.end(), kinematic_.begin(), kinematic_.end());
  for_each_index(stepped_.size(), [&](std::size_t i) { stepped_[i]->before_step = stepped_[i]->pose; });
}

std::vector<Body*> ActiveBodies::wake(Body& body) {
  body.sleep.quiet_time = 0;
  if (!body.asleep) return {};
  const auto found = sleeping_.find(body.island);
  const std::vector<Body*> group = std::move(found->second);
  sleeping_.erase(found);
  woken_ += group.size();
  for (Body* member : group) {
    member->asleep = false;
    member->sleep.quiet_time = 0;
    watched_ -= member->sleep.moving_springs.size();
    member->sleep.moving_springs.clear();
    member->sleep.pins.reset();
    member->before_step = member->before_substep = member->pose;
    stepped_.push_back(member);
  }
  note_change();
  return group;
}

void ActiveBodies::wake_all() {
  while (!sleeping_.empty()) wake(*sleeping_.begin()->second.front());
}

/// Stores the springs of bodies that fall asleep whose force may change later. Their other end is on a moving
/// kinematic body or on a particle.
void ActiveBodies::watch_springs(std::span<Body* const> group) {
  const auto sleeper = [&](const Attachment& end) -> Body* {
    const auto* point = std::get_if<BodyPoint>(&end);
    Body* body = point ? world_.bodies[point->body].get() : nullptr;
    return body && std::find(group.begin(), group.end(), body) != group.end() ? body : nullptr;
  };
  const auto moves = [&](const Attachment& end) {
    if (const auto* point = std::get_if<BodyPoint>(&end)) {
      const Body& body = *world_.bodies[point->body];
      return body.is_kinematic() && body.def.track.moves();
    }
    return std::holds_alternative<ParticlePoint>(end);
  };
  world_.springs.for_each([&](SpringHandle handle, const Spring& s) {
    if (!world_.acts(s)) return;
    for (const auto& [own, other] : {std::pair(&s.def.a, &s.def.b), {&s.def.b, &s.def.a}})
      if (Body* body = moves(*other) ? sleeper(*own) : nullptr) {
        body->sleep.moving_springs.push_back(handle);
        ++watched_;
      }
  });
}

/// Returns the wrench on a sleeping body from those forces that may change with time.
Wrench ActiveBodies::time_dependent_wrench(const Body& body, Real time) const {
  const RigidMotion at_rest{body.rigid.position, body.rigid.orientation, Vec3::Zero(), Vec3::Zero()};
  Wrench sum;
  world_.force_defs.for_each([&](ForceHandle, const ForceDef& force) {
    if (!force.changes() || !force.acts_on(body.handle) || !world_.acts(force)) return;
    const Wrench w = effect_wrench(force, time, at_rest, body.rigid.centre, body.rigid.linear_drag);
    sum.force += w.force;
    sum.torque += w.torque;
  });
  for (const SpringHandle spring : body.sleep.moving_springs)
    sum += spring_push(world_, world_.springs[spring], body, time);
  return sum;
}

bool is_pushed(const Body& body, const Wrench& push, const Wrench& at_rest) {
  const Vec3 turn = body.rigid.angular_velocity(body.rigid.orientation, push.torque - at_rest.torque);
  return (push.force - at_rest.force).norm() / body.rigid.mass + turn.norm() * body.extent > kPush;
}

void ActiveBodies::wake_pushed(Real time) {
  bool changing = false;
  world_.force_defs.for_each([&](ForceHandle, const ForceDef& force) { changing |= force.changes(); });
  if (!changing && watched_ == 0) return;
  std::vector<Body*> pushed;
  for (const auto& [number, group] : sleeping_) {
    const auto woken = std::find_if(group.begin(), group.end(), [&](const Body* body) {
      return (changing || !body->sleep.moving_springs.empty()) &&
             is_pushed(*body, time_dependent_wrench(*body, time), body->sleep.push);
    });
    if (woken != group.end()) pushed.push_back(*woken);
  }
  for (Body* body : pushed) wake(*body);
}

void ActiveBodies::put_to_sleep(std::span<const Island> islands, Real start, Real h) {
  if (!world_.def.sleep) return;
  for (Body* body : awake_)
    body->sleep.quiet_time = fastest_point(*body) < kQuietSpeed ? body->sleep.quiet_time + h : 0;
  for (const Island& island : islands) {
    if (island.bodies.empty()) continue;
    const bool quiet = std::all_of(island.bodies.begin(), island.bodies.end(), [](const Body* body) {
      return body->sleep.quiet_time >= kQuietTime && body->is_dynamic();
    });
    // A body in an island that is driven is not at rest. A body without support is quiet only for a moment,
    // at the top of its flight.
    if (!quiet || is_driven(island, start + h)) continue;
    const bool pushed =
        std::any_of(island.pairs.begin(), island.pairs.end(), [start](const ContactPair* pair) {
          const Body& other = pair->a().is_awake() ? pair->b() : pair->a();
          return (other.is_kinematic() && other.def.track.moves_after(start)) || pair->surface().conveys ||
                 overlaps(*pair);
        });
    if (pushed) continue;
    watch_springs(island.bodies);
    for (Body* body : island.bodies) {
      body->asleep = true;
      body->island = sleeping_groups_;
      body->sleep.push = time_dependent_wrench(*body, start);
      body->rigid.momentum.setZero();
      body->rigid.angular_momentum.setZero();
    }
    put_to_sleep_ += island.bodies.size();
    sleeping_.emplace(sleeping_groups_++, island.bodies);
    note_change();
  }
}

void ActiveBodies::count(StepReport& report) {
  report.bodies.woken += std::exchange(woken_, 0);
  report.bodies.put_to_sleep += std::exchange(put_to_sleep_, 0);
}

}  // namespace offstage::sim
