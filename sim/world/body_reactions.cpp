#include "sim/world/body_reactions.h"

#include <algorithm>
#include <utility>

#include "sim/dynamics/expected_acceleration.h"
#include "sim/linear/rigid_mobility.h"
#include "sim/world/resting_bodies.h"

namespace offstage::sim {
namespace {

/// A sleeping body wakes if an impact would make it faster than this [m/s].
constexpr Real kNudge = 1e-4;

Mat6 mobility_of(const RigidBody& body) {
  const Mat3 axes = body.orientation.toRotationMatrix();
  return free_mobility(1 / body.mass, axes * body.inverse_inertia * axes.transpose());
}

/// Returns the load of a body that is expected in the next sub-step. Resting contacts persist, so a load that
/// changes much is expected with the smaller of its last two values.
Wrench expected_load(const RigidBody& body, const std::array<Wrench, 3>& last) {
  std::array<Twist, 3> accelerations;
  for (std::size_t i = 0; i < last.size(); ++i)
    accelerations[i] = {last[i].force / body.mass, body.angular_velocity(body.orientation, last[i].torque)};
  const auto& [now, before, first] = accelerations;
  const Twist smaller = square(body, now) < square(body, before) ? now : before;
  const Twist expected = expected_acceleration(body, accelerations).value_or(smaller);
  return {body.mass * expected.velocity, body.spin_momentum(body.orientation, expected.angular_velocity)};
}

}  // namespace

void BodyReactions::begin_substep() {
  for (const BodyHandle handle : std::exchange(pushed_, {}))
    if (const std::unique_ptr<Body>* body = world_.bodies.find(handle)) (*body)->rigid.push = {};
  for (auto& [slot, load] : loads_) {
    const Body& body = world_.body_at(slot);
    load.expected = body.is_dynamic() ? expected_load(body.rigid, load.last) : Wrench{};
    add_force(body.handle, load.expected);
    add_force(body.handle, load.passed);
  }
}

void BodyReactions::add_force(BodyHandle handle, const Wrench& force) {
  const std::unique_ptr<Body>* body = world_.bodies.find(handle);
  if (!body) return;
  (*body)->rigid.push += force;
  pushed_.push_back(handle);
}

std::map<uint32_t, BodyImpulses::Load> BodyReactions::loads(std::span<ContactPair* const> pairs,
                                                            const Aabb& particles, Real h) {
  for (const Body* body : active_.awake())
    if (body->collides() && body->swept.intersects(particles)) loads_.try_emplace(body->handle.index);
  std::map<uint32_t, std::vector<RestingContact>> contacts;
  for (auto& [slot, load] : loads_) {
    load.mobility.reset();
    if (world_.body_at(slot).is_awake() && !joints_.articulation_of(slot)) contacts[slot];
  }
  find_resting_contacts(pairs, h, contacts);
  for (auto& [slot, found] : contacts) {
    std::erase_if(found, [](const RestingContact& c) { return c.yield > 0; });  // on bodies that yield
    const Mat6 free = mobility_of(world_.body_at(slot).rigid);
    if (!found.empty()) loads_[slot].mobility = RestingContacts(std::move(found), free).held_mobility(free);
  }
  std::map<uint32_t, BodyImpulses::Load> loads;
  for (const auto& [slot, load] : loads_) loads[slot] = {h * load.expected, load.mobility};
  return loads;
}

/// Returns the part of the impulses on a body that its contacts with other bodies do not balance. The other
/// part acts on the bodies beneath in the next sub-step. They have carried the expected load already: where
/// the particles press less, nothing is passed on.
Reaction BodyReactions::balance(const Body& body, Load& load, const Reaction& sum, Real h) const {
  if (!load.mobility) return sum;
  const auto left = [&](const Vec6& impulse) {
    const Vec6 gained = *load.mobility * impulse;
    return stacked(body.rigid.mass * gained.head<3>(),
                   body.rigid.spin_momentum(body.rigid.orientation, gained.tail<3>()));
  };
  const Vec6 impulse = stacked(sum.impulse, sum.angular_impulse), expected = h * stacked(load.expected);
  const Real along = impulse.head<3>().dot(expected.head<3>()), size2 = expected.head<3>().squaredNorm();
  const Real unloaded = size2 > 0 ? std::clamp(-along / size2, 0.0, 1.0) : 0;
  const Vec6 pressing = impulse + unloaded * expected, passed = (pressing - left(pressing)) / h;
  load.passed = {passed.head<3>(), passed.tail<3>()};
  const Vec6 own = left(impulse);
  return {sum.body, own.head<3>(), own.tail<3>()};
}

/// Moves the bodies by the impulses of resting particles beyond the expected ones.
void BodyReactions::displace(Real h) {
  const auto move = [&](Body& body, const Vec6& change) {
    body.pose = displaced(body.pose, body.rigid.centre, h * change.head<3>(), h * change.tail<3>());
    body.rigid.place(body.pose);
  };
  std::map<uint32_t, std::pair<Articulation*, std::vector<Vec6>>> jointed;  // by slot of the first link
  for (const auto& [slot, load] : loads_) {
    Body& body = world_.body_at(slot);
    const Vec6 more = h * (stacked(load.last[0]) - stacked(load.expected));
    if (!body.is_awake() || more.isZero(0)) continue;
    Articulation* articulation = joints_.articulation_of(slot);
    if (!articulation) {
      move(body, (load.mobility ? *load.mobility : mobility_of(body.rigid)) * more);
      continue;
    }
    auto& [moved, changes] = jointed[articulation->bodies().front()->handle.index];
    moved = articulation;
    changes.resize(articulation->link_count(), Vec6::Zero());
    articulation->respond(joints_.link(slot).index, more, changes);
  }
  for (const auto& [slot, links] : jointed)
    for (std::size_t i = 0; i < links.second.size(); ++i) {
      Body& link = *links.first->bodies()[i];
      if (link.is_awake()) move(link, links.second[i]);
    }
}

void BodyReactions::apply_particles(const BodyImpulses& impulses, Real time, Real h, StepReport& report) {
  for (auto& [slot, load] : loads_) {
    load.last = {Wrench{}, load.last[0], load.last[1]};
    load.passed = {};
  }
  for (const auto& [slot, impulse] : impulses.loads()) loads_[slot].last[0] = (1 / h) * impulse;
  std::vector<Reaction> reactions = impulses.sums();
  for (Reaction& r : reactions)
    if (const auto load = loads_.find(r.body); load != loads_.end())
      r = balance(world_.body_at(r.body), load->second, r, h);
  displace(h);
  apply(reactions, time, report);
  const auto is_zero = [](const Wrench& w) { return w.force.isZero(0) && w.torque.isZero(0); };
  std::erase_if(loads_, [&](const auto& entry) {
    return std::ranges::all_of(entry.second.last, is_zero) && is_zero(entry.second.passed);
  });
}

void BodyReactions::forget(const Body& body) {
  pending_.erase(body.handle.index);
  loads_.erase(body.handle.index);
}

void BodyReactions::apply(std::span<const Reaction> reactions, Real time, StepReport& report) {
  std::vector<uint32_t> pushed;
  for (const Reaction& r : reactions) {
    Reaction& sum = pending_.try_emplace(r.body, Reaction{r.body, Vec3::Zero(), Vec3::Zero()}).first->second;
    sum.impulse += r.impulse;
    sum.angular_impulse += r.angular_impulse;
  }
  std::erase_if(pending_, [&](const auto& entry) {
    const Reaction& sum = entry.second;
    Body& body = world_.body_at(sum.body);
    if (!body.is_dynamic()) return true;
    const Vec3 turn = body.rigid.angular_velocity(body.rigid.orientation, sum.angular_impulse);
    const Real speed = sum.impulse.norm() / body.rigid.mass + turn.norm() * body.extent;
    if (body.asleep && speed < kNudge) return false;
    if (body.asleep) active_.wake(body);
    body.rigid.momentum += sum.impulse;
    body.rigid.angular_momentum += sum.angular_impulse;
    pushed.push_back(sum.body);
    return true;
  });
  JointFigures figures;
  for (const uint32_t slot : pushed) {
    Articulation* articulation = joints_.articulation_of(slot);
    if (!articulation) continue;
    articulation->transmit_impulses(time, figures);
    for (Body* link : articulation->bodies()) link->pose = link->rigid.pose();
  }
  report.joints.add(figures);
}

}  // namespace offstage::sim
