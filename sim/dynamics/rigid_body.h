#pragma once
/// State and equations of motion of a rigid body (physics R1). Integration uses (x, q) and the momenta (L,
/// H), so torque-free motion conserves the angular momentum exactly.

#include "sim/core/twist.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// The variables of a rigid body that change with time.
struct RigidState {
  Vec3 position = Vec3::Zero();  ///< position of the centre of mass, world
  Quat orientation = Quat::Identity();
  Vec3 momentum = Vec3::Zero();  ///< linear momentum L [kg m/s]
  /// Angular momentum H about the centre of mass, world axes [kg m^2/s].
  Vec3 angular_momentum = Vec3::Zero();
  Real next_step = 0;  ///< adaptive integrators: length of the next step [s]; 0: unknown
};

struct RigidBody : RigidState {
  Real mass = 1;
  Vec3 centre = Vec3::Zero();       ///< centre of mass in the shape's frame
  Mat3 inertia = Mat3::Identity();  ///< inertia about the centre of mass, axes of the shape's frame [kg m^2]
  Mat3 inverse_inertia = Mat3::Identity();
  Real linear_drag = 0, angular_drag = 0;
  Wrench push;  ///< constant force and torque in the current sub-step, by cloth and particles [N], [N m]

  bool is_pushed() const { return push.force != Vec3::Zero() || push.torque != Vec3::Zero(); }
  const RigidState& state() const { return *this; }
  void set_state(const RigidState& state) { static_cast<RigidState&>(*this) = state; }

  Vec3 velocity() const { return momentum / mass; }
  /// w = R I^-1 R^T H.
  Vec3 angular_velocity() const { return angular_velocity(orientation, angular_momentum); }
  Vec3 angular_velocity(const Quat& q, const Vec3& H) const {
    return q * (inverse_inertia * (q.conjugate() * H));
  }
  /// Returns the angular momentum H for the orientation q and the angular velocity w.
  Vec3 spin_momentum(const Quat& q, const Vec3& w) const { return q * (inertia * (q.conjugate() * w)); }
  /// Whether the greatest moment of inertia is more than about ten times the smallest one. The measure is tr
  /// I tr I^-1, which is 9 for a ball and 10 for a coin.
  bool is_thin() const { return inertia.trace() * inverse_inertia.trace() > 26; }
  Pose pose() const { return {position - orientation * centre, orientation}; }

  void place(const Pose& pose) {
    orientation = pose.orientation.normalized();
    position = pose.position + orientation * centre;
  }
  void set_velocity(const Vec3& v, const Vec3& w) {
    momentum = mass * v;
    angular_momentum = spin_momentum(orientation, w);
  }
};

}  // namespace offstage::sim
