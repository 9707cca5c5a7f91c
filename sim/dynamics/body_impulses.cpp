#include "sim/dynamics/body_impulses.h"

#include "sim/dynamics/rigid_jacobian.h"

namespace offstage::sim {

void BodyImpulses::begin(std::span<const Link> links) {
  links_ = links;
  sums_.clear();
  gained_.clear();
}

Mat3 BodyImpulses::mobility(const Obstacle& o, const Vec3& arm, const Vec3& push) const {
  const Link at = link(o.body);
  if (!at.bodies || !o.is_dynamic()) return o.mobility(arm);
  // The point's velocity is v + w x arm = E (v, w), and an impulse P at the point acts as E^T P.
  Eigen::Matrix<Real, 3, 6> E;
  E << Mat3::Identity(), -cross_matrix(arm);
  return E * at.bodies->link_mobility(at.index, E.transpose() * push) * E.transpose();
}

Vec3 BodyImpulses::velocity(const Obstacle& o, const Vec3& arm) const {
  Vec3 velocity = o.end_velocity, spin = o.end_spin;
  if (const Link at = link(o.body); at.bodies) {
    if (const auto known = gained_.find(at.bodies); known != gained_.end()) {
      velocity += known->second[at.index].head<3>();
      spin += known->second[at.index].tail<3>();
    }
  } else if (const auto sum = sums_.find(o.body); sum != sums_.end()) {
    velocity += o.inverse_mass * sum->second.impulse;
    spin += o.inverse_inertia * sum->second.angular_impulse;
  }
  return velocity + spin.cross(arm);
}

void BodyImpulses::push(const Reaction& reaction) {
  Reaction& sum =
      sums_.try_emplace(reaction.body, Reaction{reaction.body, Vec3::Zero(), Vec3::Zero()}).first->second;
  sum.impulse += reaction.impulse;
  sum.angular_impulse += reaction.angular_impulse;
  const Link at = link(reaction.body);
  if (!at.bodies) return;
  std::vector<Vec6>& gained = gained_[at.bodies];
  if (gained.empty()) gained.assign(at.bodies->link_count(), Vec6::Zero());
  Vec6 impulse;
  impulse << reaction.impulse, reaction.angular_impulse;
  at.bodies->respond(at.index, impulse, gained);
}

std::vector<Reaction> BodyImpulses::sums() const {
  std::vector<Reaction> all;
  for (const auto& [body, sum] : sums_) all.push_back(sum);
  return all;
}

}  // namespace offstage::sim
