#pragma once
/// Rigid motions, wrenches, and how a body responds to impulses.

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
inline bool is_zero(const Wrench& w) {
  return w.force.isZero(0) && w.torque.isZero(0);
}
inline Wrench operator*(Real factor, const Wrench& w) {
  return {factor * w.force, factor * w.torque};
}

/// Returns the matrix M for which M u is the cross product v x u.
inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Returns the mobility of the point at `arm` from a body's centre of mass [1/kg]: its change of velocity per
/// unit of impulse there, world axes.
inline Mat3 point_mobility(Real inverse_mass, const Mat3& inverse_inertia, const Vec3& arm) {
  const Mat3 cross = cross_matrix(arm);
  return inverse_mass * Mat3::Identity() - cross * inverse_inertia * cross;
}

/// Returns a pose after its point `centre` (body frame) has moved by `shift`, and the body has turned about
/// it by a small angle.
inline Pose displaced(const Pose& pose, const Vec3& centre, const Vec3& shift, const Vec3& turn) {
  if (shift == Vec3::Zero() && turn == Vec3::Zero()) return pose;
  const Vec3 place = pose.point_to_world(centre) + shift;
  const Quat q(1, turn.x() / 2, turn.y() / 2, turn.z() / 2);
  Pose result;
  result.orientation = (q * pose.orientation).normalized();
  result.position = place - result.vector_to_world(centre);
  return result;
}

}  // namespace offstage::sim
