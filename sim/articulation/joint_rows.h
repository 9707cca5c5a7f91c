#pragma once
/// The kinematics of joints: each is a number of scalar constraints C(x) = 0, with dC/dt = J v and
/// d2C/dt2 = J a + bias, where v and a are the velocities and accelerations of both links, [linear, angular]
/// about their centres, in world axes (physics A1, A6).

#include <cstdint>

#include "sim/articulation/joint.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// How a link moves at a moment: about its centre of mass, or the origin of one that is driven.
struct LinkMotion {
  Vec3 position = Vec3::Zero();
  Mat3 axes = Mat3::Identity();  ///< world from body
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
};

/// What impulses do to a link: [1/kg], and world axes [1/(kg m^2)].
struct LinkMobility {
  Real inverse_mass = 0;
  Mat3 inverse_inertia = Mat3::Zero();

  Vec6 velocity(const Vec6& impulse) const {
    Vec6 v;
    v << inverse_mass * impulse.head<3>(), inverse_inertia * impulse.tail<3>();
    return v;
  }
};

/// Where a joint is on a link: from its centre, in its axes. Columns of `axes`: the second axis, what makes a
/// right-handed frame, the axis.
struct JointFrame {
  Vec3 point = Vec3::Zero();
  Mat3 axes = Mat3::Identity();
};

/// Both ends of a joint at a moment.
struct JointPlace {
  JointPlace(const LinkMotion& a, const JointFrame& on_a, const LinkMotion& b, const JointFrame& on_b);

  const LinkMotion &a, &b;
  Vec3 arm_a, arm_b;    ///< from the links' centres to the anchors, world
  Vec3 apart;           ///< from the anchor on b to that on a
  Mat3 axes_a, axes_b;  ///< world
};

/// One constraint, or one free direction: J = [on_a, on_b].
struct JointRow {
  Vec6 on_a, on_b;
  Real error = 0, bias = 0;
};

/// What keeps a joint together, up to six constraints; those beyond `count` are zero.
struct JointRows {
  uint32_t count = 0;
  Mat6 on_a = Mat6::Zero(), on_b = Mat6::Zero();  ///< J^T: a column for each
  Vec6 error = Vec6::Zero(), bias = Vec6::Zero();

  void add(const JointRow& row);
};

/// Of a distance joint only if it is a rod, which has a length to keep.
uint32_t constraint_count(const JointDef& def);
/// `length` of a rod.
void set_joint_rows(const JointDef& def, const JointPlace& place, Real length, JointRows& rows);

/// The free coordinate of a revolute, prismatic or distance joint, the first of a universal one, the twist of
/// a spherical one, with its row; `error` is the coordinate, of angles within half a turn.
JointRow free_row(JointType type, const JointPlace& place, Real length);
/// How far the axis of a spherical joint leans, or the second angle of a universal one.
JointRow swing_row(JointType type, const JointPlace& place);
/// Turning of a against b about a world axis.
JointRow turning_row(const Vec3& axis);

/// The angle of (x, y) from the x axis, in [-pi, pi], with the same bits everywhere.
Real angle_of(Real y, Real x);

}  // namespace offstage::sim
