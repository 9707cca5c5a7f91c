#pragma once
/// Kinematics of joints. A joint consists of scalar constraints C(x) = 0, with dC/dt = J v and d2C/dt2 = J a
/// + bias, where v and a are the velocities and accelerations of both links, [linear, angular] about their
/// centres, in world axes (physics A1, A6).

#include <cstdint>

#include "sim/articulation/joint.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// Motion of a link's centre of mass at one time, in world axes [m], [m/s], [rad/s]; for a kinematic link,
/// motion of its origin.
struct LinkMotion {
  Vec3 position = Vec3::Zero();
  Mat3 axes = Mat3::Identity();  ///< world from body
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
};

/// Inverse mass [1/kg] and inverse inertia of a link, in world axes [1/(kg m^2)].
struct LinkMobility {
  Real inverse_mass = 0;
  Mat3 inverse_inertia = Mat3::Zero();

  Vec6 velocity(const Vec6& impulse) const {
    Vec6 v;
    v << inverse_mass * impulse.head<3>(), inverse_inertia * impulse.tail<3>();
    return v;
  }
};

/// Frame of a joint on a link, relative to the link's centre and in the link's axes. The columns of `axes`
/// are: the second axis, the cross product of axis and second axis, and the axis.
struct JointFrame {
  Vec3 point = Vec3::Zero();
  Mat3 axes = Mat3::Identity();
};

/// State of both ends of a joint at one time.
struct JointPlace {
  JointPlace(const LinkMotion& a, const JointFrame& on_a, const LinkMotion& b, const JointFrame& on_b);

  const LinkMotion &a, &b;
  Vec3 arm_a, arm_b;    ///< vectors from the links' centres to the anchors, world axes [m]
  Vec3 apart;           ///< vector from the anchor on b to the anchor on a, world axes [m]
  Mat3 axes_a, axes_b;  ///< axes of the joint on a and on b, as columns, in the world
};

/// One constraint or one free direction: J = [on_a, on_b].
struct JointRow {
  Vec6 on_a, on_b;
  Real error = 0, bias = 0;
};

/// The constraints of a joint, up to six. Rows beyond `count` are zero.
struct JointRows {
  uint32_t count = 0;
  Mat6 on_a = Mat6::Zero(), on_b = Mat6::Zero();  ///< J^T: a column for each constraint
  Vec6 error = Vec6::Zero(), bias = Vec6::Zero();
  Vec6 softness =
      Vec6::Zero();  ///< compliance: the row's speed is reduced by softness times its impulse [1/kg]

  void add(const JointRow& row);
};

/// Number of scalar constraints of a joint, 0 to 6. A distance joint has a constraint only if it is a rod.
uint32_t constraint_count(const JointDef& def);
/// Returns the axes of a joint's frame on body a (or b, if `of_b`) when the joint is created, in the world.
/// For the columns see JointFrame::axes.
Mat3 frame_axes(const JointDef& def, bool of_b);
/// Returns the change of Joint::length of a gear, rack or screw due to whole turns of its rotations. Call it
/// after each motion, and at least once per half turn.
Real turns_offset(const JointDef& def, const JointPlace& place, Real length);
/// Computes the constraint rows of a joint. `length`: Joint::length.
void set_joint_rows(const JointDef& def, const JointPlace& place, Real length, JointRows& rows);

/// Returns the row of the free coordinate. For a universal joint this is its first angle, for a spherical
/// joint its twist. JointRow::error is the coordinate [m] or [rad]; angles are in [-pi, pi].
JointRow free_row(const JointDef& def, const JointPlace& place, Real length);
/// Row of the tilt of a spherical joint's axis, or of the second angle of a universal joint.
JointRow swing_row(JointType type, const JointPlace& place);
/// Row of the rotation of a relative to b about a world axis.
JointRow turning_row(const Vec3& axis);

/// Rotation vector of a relative to b, in b's axes [rad].
Vec3 rotation_vector(const JointPlace& place);

/// Returns the angle of (x, y) from the x axis [rad], in [-pi, pi]. The result is bitwise identical on all
/// machines.
Real angle_of(Real y, Real x);

}  // namespace offstage::sim
