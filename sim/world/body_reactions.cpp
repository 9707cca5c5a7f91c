#include "sim/world/body_reactions.h"

#include <algorithm>
#include <utility>

#include "sim/linear/rigid_mobility.h"
#include "sim/world/resting_bodies.h"

namespace offstage::sim {
namespace {

/// A sleeping body wakes if an impact would make it faster than this [m/s].
constexpr Real kNudge = 1e-4;

/// Moves a body by a small translation and rotation [m], [rad].
void move(Body& body, const Vec6& change) {
  body.pose = displaced(body.pose, body.rigid.centre, change.head<3>(), change.tail<3>());
  body.rigid.place(body.pose);
}

Mat6 mobility_of(const RigidBody& body) {
  const Mat3 axes = body.orientation.toRotationMatrix();
  return free_mobility(1 / body.mass, axes * body.inverse_inertia * axes.transpose());
}

}  // namespace

void BodyReactions::begin_substep() {
  for (const BodyHandle handle : std::exchange(pushed_, {}))
    if (const std::unique_ptr<Body>* body = world_.bodies.find(handle)) (*body)->rigid.push = {};
  for (auto& [slot, load] : loads_) {
    const Body& body = world_.body_at(slot);
    body.is_dynamic() ? load.force.expect(body.rigid) : load.force.expect_nothing();
    add_force(body.handle, load.force.expected());
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
  for (const auto& [slot, load] : loads_) loads[slot] = {h * load.force.expected(), load.mobility};
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
  const Vec6 impulse = stacked(sum.impulse, sum.angular_impulse),
             expected = h * stacked(load.force.expected());
  const Real along = impulse.head<3>().dot(expected.head<3>()), size2 = expected.head<3>().squaredNorm();
  const Real unloaded = size2 > 0 ? std::clamp(-along / size2, 0.0, 1.0) : 0;
  const Vec6 pressing = impulse + unloaded * expected, passed = (pressing - left(pressing)) / h;
  load.passed = {passed.head<3>(), passed.tail<3>()};
  const Vec6 own = left(impulse);
  return {sum.body, own.head<3>(), own.tail<3>()};
}

/// Moves the bodies by the impulses of resting particles beyond the expected ones.
void BodyReactions::displace(Real h) {
  std::map<uint32_t, Vec6> jointed;
  for (const auto& [slot, load] : loads_) {
    Body& body = world_.body_at(slot);
    const Vec6 more = h * h * (stacked(load.force.last()) - stacked(load.force.expected()));
    if (!body.is_awake() || more.isZero(0)) continue;
    if (joints_.articulation_of(slot))
      jointed[slot] = more;
    else
      move(body, (load.mobility ? *load.mobility : mobility_of(body.rigid)) * more);
  }
  displace_links(jointed);
}

std::map<uint32_t, Mat6> BodyReactions::link_responses(uint32_t slot, const Vec6& push) const {
  Articulation* articulation = joints_.articulation_of(slot);
  if (!articulation) return {};
  const std::vector<Mat6> of_links = articulation->link_responses(joints_.link(slot).index, push);
  std::map<uint32_t, Mat6> responses;
  for (std::size_t i = 0; i < of_links.size(); ++i)
    responses[articulation->bodies()[i]->handle.index] = of_links[i];
  return responses;
}

void BodyReactions::displace_links(const std::map<uint32_t, Vec6>& pushes) {
  std::map<uint32_t, std::pair<Articulation*, std::vector<Vec6>>> moved;  // by slot of the first link
  for (const auto& [slot, push] : pushes) {
    Articulation* articulation = joints_.articulation_of(slot);
    auto& [of, changes] = moved[articulation->bodies().front()->handle.index];
    of = articulation;
    changes.resize(articulation->link_count(), Vec6::Zero());
    articulation->respond(joints_.link(slot).index, push, changes);
  }
  for (const auto& [slot, links] : moved)
    for (std::size_t i = 0; i < links.second.size(); ++i) {
      Body& link = *links.first->bodies()[i];
      if (link.is_awake()) move(link, links.second[i]);
    }
}

void BodyReactions::apply_particles(const BodyImpulses& impulses, Real time, Real h, StepReport& report) {
  for (const auto& [slot, impulse] : impulses.loads()) loads_.try_emplace(slot);
  for (auto& [slot, load] : loads_) {
    const auto impulse = impulses.loads().find(slot);
    load.force.record(impulse == impulses.loads().end() ? Wrench{} : (1 / h) * impulse->second);
    load.passed = {};
  }
  std::vector<Reaction> reactions = impulses.sums();
  for (Reaction& r : reactions)
    if (const auto load = loads_.find(r.body); load != loads_.end())
      r = balance(world_.body_at(r.body), load->second, r, h);
  displace(h);
  apply(reactions, time, report);
  std::erase_if(
      loads_, [](const auto& entry) { return entry.second.force.is_over() && is_zero(entry.second.passed); });
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
