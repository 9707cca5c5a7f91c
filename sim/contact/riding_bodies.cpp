#include "sim/contact/riding_bodies.h"

#include <algorithm>

#include "sim/contact/contact_terms.h"

namespace offstage::sim {
namespace {

/// Greatest velocity of a riding body relative to its carrier [m/s].
constexpr Real kRides = 1e-3;
/// Greatest number of passes that look for bodies on riding bodies: the height of a stack.
constexpr int kMostPasses = 20;

}  // namespace

bool RidingBodies::can_carry(const Body& body) {
  return body.is_kinematic() &&
         (body.drive.angular_velocity != Vec3::Zero() || body.drive.velocity != body.start_twist.velocity ||
          body.start_twist.angular_velocity != Vec3::Zero());
}

void RidingBodies::find(const Island& island, std::span<const ContactBody> bodies,
                        std::span<const Contact> contacts, std::span<const ContactPair* const> pairs,
                        Real duration) {
  carriers_.assign(island.bodies.size(), nullptr);
  deviations_.assign(island.bodies.size(), {});
  const auto carrier_of = [&](const Body& body) -> const Body* {
    if (body.is_kinematic()) return can_carry(body) ? &body : nullptr;
    return body.is_awake() ? carriers_[body.row] : nullptr;
  };
  const auto spread = [&](const Body& from, const Body& to) {
    const Body* const carrier = carrier_of(from);
    return carrier && to.is_awake() && !carriers_[to.row] &&
           board(island, bodies, to.row, *carrier, duration);
  };
  bool changed = true;
  for (int pass = 0; changed && pass < kMostPasses; ++pass) {
    changed = false;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (!(contacts[i].impulse.x() > 0)) continue;
      changed |= spread(pairs[i]->a(), pairs[i]->b());
      changed |= spread(pairs[i]->b(), pairs[i]->a());
    }
  }
  // Joints would pull a link that rides back to links that do not.
  for (const Articulation* articulation : island.articulations) {
    const std::span<Body* const> links = articulation->bodies();
    const auto find_carrier = [&](const Body* link) { return carriers_[link->row] != nullptr; };
    const auto first = std::find_if(links.begin(), links.end(), find_carrier);
    if (first == links.end()) continue;
    const Body& carrier = *carriers_[(*first)->row];
    const bool all = std::all_of(links.begin(), links.end(), [&](const Body* link) {
      return carriers_[link->row] == &carrier ||
             (!carriers_[link->row] && board(island, bodies, link->row, carrier, duration));
    });
    if (all) continue;
    for (const Body* link : links) {
      carriers_[link->row] = nullptr;
      deviations_[link->row] = {};
    }
  }
}

/// Lets the i-th body ride on the carrier if it moves with it. Returns whether it does.
bool RidingBodies::board(const Island& island, std::span<const ContactBody> bodies, std::size_t i,
                         const Body& carrier, Real duration) {
  const Body& body = *island.bodies[i];
  const Twist &first = carrier.start_twist, &last = carrier.drive;
  const Vec3& place = body.start.position;
  const Vec3 end = carrier.pose.point_to_world(carrier.start_pose.point_to_body(place));
  const Vec3 v_start = first.at(place - carrier.start_pose.position),
             v_end = last.at(end - carrier.pose.position);
  const Vec3 slip_start = body.start_twist.angular_velocity - first.angular_velocity,
             slip_end = bodies[i].angular_velocity - last.angular_velocity;
  if ((body.start_twist.velocity - v_start).norm() + body.extent * slip_start.norm() > kRides ||
      (bodies[i].velocity - v_end).norm() + body.extent * slip_end.norm() > kRides)
    return false;
  carriers_[i] = &carrier;
  deviations_[i].shift = end - place - duration / 2 * (v_start + v_end);
  deviations_[i].turn = rotation_vector(carrier.start_pose.orientation, carrier.pose.orientation) -
                        duration / 2 * (first.angular_velocity + last.angular_velocity);
  return true;
}

}  // namespace offstage::sim
