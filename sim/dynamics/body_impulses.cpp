#include "sim/dynamics/body_impulses.h"

#include <utility>

#include "sim/dynamics/rigid_jacobian.h"

namespace offstage::sim {

void BodyImpulses::begin(std::span<const Link> links, std::map<uint32_t, Load> expected) {
  links_ = links;
  expected_ = std::move(expected);
  loads_.clear();
  sums_.clear();
  gained_.clear();
}

Mat3 BodyImpulses::mobility(const Obstacle& o, const Vec3& arm, const Vec3& push) const {
  const auto load = expected_.find(o.body);
  const bool is_held = load != expected_.end() && load->second.mobility;
  if (!o.is_dynamic() || (!link(o.body).bodies && !is_held)) return o.mobility(arm);
  // The point's velocity is v + w x arm = E (v, w), and an impulse P at the point acts as E^T P.
  Eigen::Matrix<Real, 3, 6> E;
  E << Mat3::Identity(), -cross_matrix(arm);
  return E * mobility(o, Vec6(E.transpose() * push)) * E.transpose();
}

Mat6 BodyImpulses::mobility(const Obstacle& o, const Vec6& push) const {
  if (const auto load = expected_.find(o.body); load != expected_.end() && load->second.mobility)
    return *load->second.mobility;
  if (const Link at = link(o.body); at.bodies) return at.bodies->link_mobility(at.index, push);
  Mat6 mobility = Mat6::Zero();
  mobility.topLeftCorner<3, 3>() = o.inverse_mass * Mat3::Identity();
  mobility.bottomRightCorner<3, 3>() = o.inverse_inertia;
  return mobility;
}

Wrench BodyImpulses::expected(uint32_t body) const {
  const auto found = expected_.find(body);
  return found == expected_.end() ? Wrench{} : found->second.expected;
}

Vec3 BodyImpulses::velocity(const Obstacle& o, const Vec3& arm) const {
  Vec3 velocity = o.end_velocity, spin = o.end_spin;
  if (const Link at = link(o.body); at.bodies) {
    if (const auto known = gained_.find(at.bodies); known != gained_.end()) {
      velocity += known->second[at.index].head<3>();
      spin += known->second[at.index].tail<3>();
    }
  } else if (const auto sum = sums_.find(o.body); sum != sums_.end()) {
    Vec6 impulse;
    impulse << sum->second.impulse, sum->second.angular_impulse;
    const Vec6 gained = mobility(o, impulse) * impulse;
    velocity += gained.head<3>();
    spin += gained.tail<3>();
  }
  return velocity + spin.cross(arm);
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
  Vec6 impulse;
  impulse << reaction.impulse, reaction.angular_impulse;
  at.bodies->respond(at.index, impulse, gained);
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
