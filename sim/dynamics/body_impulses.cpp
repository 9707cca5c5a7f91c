#include "sim/dynamics/body_impulses.h"

#include <utility>

#include "sim/linear/rigid_mobility.h"

namespace offstage::sim {

void BodyImpulses::begin(std::span<const Link> links, std::map<uint32_t, Load> expected) {
  links_ = links;
  expected_ = std::move(expected);
  loads_.clear();
  sums_.clear();
  gained_.clear();
}

/// Returns the mobility of a body that rests on others; null for other bodies.
const Mat6* BodyImpulses::held_mobility(uint32_t body) const {
  const auto load = expected_.find(body);
  return load != expected_.end() && load->second.mobility ? &*load->second.mobility : nullptr;
}

Mat3 BodyImpulses::mobility(const Obstacle& o, const Vec3& arm, const Vec3& push) const {
  if (!o.is_dynamic() || (!link(o.body).bodies && !held_mobility(o.body))) return o.mobility(arm);
  const auto E = point_velocity(arm);
  return E * mobility(o, Vec6(E.transpose() * push)) * E.transpose();
}

Mat6 BodyImpulses::mobility(const Obstacle& o, const Vec6& push) const {
  if (const Mat6* held = held_mobility(o.body)) return *held;
  if (const Link at = link(o.body); at.bodies) return at.bodies->link_mobility(at.index, push);
  return free_mobility(o.inverse_mass, o.inverse_inertia);
}

Wrench BodyImpulses::expected(uint32_t body) const {
  const auto found = expected_.find(body);
  return found == expected_.end() ? Wrench{} : found->second.expected;
}

Vec6 BodyImpulses::gained(const Obstacle& o) const {
  if (const Link at = link(o.body); at.bodies) {
    const auto known = gained_.find(at.bodies);
    return known == gained_.end() ? Vec6(Vec6::Zero()) : known->second[at.index];
  }
  const auto sum = sums_.find(o.body);
  if (sum == sums_.end()) return Vec6::Zero();
  const Vec6 impulse = stacked(sum->second.impulse, sum->second.angular_impulse);
  return mobility(o, impulse) * impulse;
}

Vec3 BodyImpulses::velocity(const Obstacle& o, const Vec3& arm) const {
  const Vec6 more = gained(o);
  return o.end_velocity + more.head<3>() + (o.end_spin + more.tail<3>()).cross(arm);
}

void BodyImpulses::push(const Reaction& reaction) {
  Reaction& sum =
      sums_.try_emplace(reaction.body, Reaction{reaction.body, Vec3::Zero(), Vec3::Zero()}).first->second;
  sum.impulse += reaction.impulse;
  sum.angular_impulse += reaction.angular_impulse;
  if (reaction.is_load) loads_[reaction.body] += {reaction.impulse, reaction.angular_impulse};
  const Link at = link(reaction.body);
  if (!at.bodies) return;
  std::vector<Vec6>& gained = gained_[at.bodies];
  if (gained.empty()) gained.assign(at.bodies->link_count(), Vec6::Zero());
  at.bodies->respond(at.index, stacked(reaction.impulse, reaction.angular_impulse), gained);
}

void BodyImpulses::subtract_expected() {
  for (const auto& [body, load] : expected_) push({body, -load.expected.force, -load.expected.torque});
}

std::vector<Reaction> BodyImpulses::sums() const {
  std::vector<Reaction> all;
  for (const auto& [body, sum] : sums_) all.push_back(sum);
  return all;
}

}  // namespace offstage::sim
