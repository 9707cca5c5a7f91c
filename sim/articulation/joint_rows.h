#pragma once
/// Kinematics of joints. A joint consists of scalar constraints C(x) = 0, with dC/dt = J v and d2C/dt2 = J a
/// + bias, where v and a are the velocities and accelerations of both links, [linear, angular] about their
/// centres, in world axes (physics A1, A6).

#include <cstdint>

#include "sim/articulation/joint.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// Motion of a link at a time: of its centre of mass, or of its origin if it is kinematic.
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

/// Frame of a joint on a link, relative to the link's centre and in its axes. The columns of `axes` are the
/// second axis, their cross product for a right-handed frame, and the axis.
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
  Vec6 softness = Vec6::Zero();  ///< change of the row's speed that its own impulse takes back

  void add(const JointRow& row);
};

/// Number of constraints. A distance joint has one only if it is a rod.
uint32_t constraint_count(const JointDef& def);
/// Axes of a joint's frame on body a or on body b, in the world when the joint is created: the columns of
/// JointFrame::axes.
Mat3 frame_axes(const JointDef& def, bool of_b);
/// Whole turns of coupled rotations change the constraint of a gear, rack or screw; this is the change of
/// Joint::length after a motion in which each rotation was at most half a turn.
Real turns_offset(const JointDef& def, const JointPlace& place, Real length);
/// Computes the rows of a joint; `length` is that of a rod, or the offset by whole turns of a gear, rack or
/// screw.
void set_joint_rows(const JointDef& def, const JointPlace& place, Real length, JointRows& rows);

/// Row of the free coordinate of a revolute, prismatic, distance, screw or pulley joint, the first angle of a
/// universal joint, or the twist of a spherical joint. `error` is the coordinate; angles are within half a
/// turn.
JointRow free_row(const JointDef& def, const JointPlace& place, Real length);
/// Row of the tilt of a spherical joint's axis, or of the second angle of a universal joint.
JointRow swing_row(JointType type, const JointPlace& place);
/// Row of the rotation of a relative to b about a world axis.
JointRow turning_row(const Vec3& axis);

/// Rotation vector of a relative to b, in b's axes [rad].
Vec3 rotation_vector(const JointPlace& place);

/// The angle of (x, y) from the x axis, in [-pi, pi], with the same bits everywhere.
Real angle_of(Real y, Real x);

}  // namespace offstage::sim
