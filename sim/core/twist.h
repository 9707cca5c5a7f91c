#pragma once
/// Rigid motions and wrenches.

#include "sim/core/types.h"

namespace offstage::sim {

/// A rigid motion: velocity of the material point at the frame's origin [m/s], and angular velocity [rad/s].
struct Twist {
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();

  Vec3 at(const Vec3& p) const { return velocity + angular_velocity.cross(p); }
};

/// A force and a torque, or an impulse and an angular impulse, in world axes. The torque is about the centre
/// of mass unless stated otherwise.
struct Wrench {
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();

  Wrench& operator+=(const Wrench& w) {
    force += w.force;
    torque += w.torque;
    return *this;
  }
};

}  // namespace offstage::sim
