#pragma once
/// How a contact moves within an interval, predicted from the bodies' motion at its start (physics R9, R11).
///
/// A contact has its arms (from the centres of mass) and its normal n. Both change while the bodies move: a
/// corner goes with its body, the lowest point of a rim runs along the rim, and the normal turns with the
/// face or between the centres that it comes from. A contact that is solved with the arms and the normal of
/// the interval's start is right to the first order of the interval alone: a rolling coin stands up or falls.
/// Here the impulse acts at the interval's middle, and the velocities that the contact speaks of are those of
/// its end. Impulse and angular momentum then agree to the second order, for bodies that move by the mean of
/// old and new velocity.

#include "sim/collision/contact_frame.h"
#include "sim/collision/manifold.h"
#include "sim/dynamics/body.h"

namespace offstage::sim {

/// A contact at one time of the interval.
struct ContactPlace {
  Vec3 normal;        ///< unit, from b to a, world
  Vec3 arm_a, arm_b;  ///< from the bodies' centres of mass (of kinematic bodies their origins) [m]
  Quat turn;          ///< by which the body that carries the contact has turned since the start
};

struct ContactMotion {
  ContactPlace middle;
  ContactFrame frame;  ///< at the middle
  /// What the turning of arms and normal alone makes of the relative velocity at the contact, in `frame`
  /// (n, t, k): gain s + bow s^2, where s goes from -1 at the start over 0 in the middle to 1 at the end
  /// [m/s].
  Vec3 gain = Vec3::Zero(), bow = Vec3::Zero();
  /// The gain of the normal velocity of points beside it, per metre along the tangents t and k [1/s].
  Real gain_along_t = 0, gain_along_k = 0;
  bool turns = false;  ///< whether any gain is not 0
};

/// Where a body's centre of mass is at the interval's start, or of a kinematic body its origin.
Vec3 start_centre(const Body& body);

/// Whether contacts may run along a body while it turns: along the rims and round sides of one that turns
/// noticeably within a time [s].
bool runs_along(const Body& body, Real duration);

/// For a contact of a manifold whose frame is `frame`, at a place of the world at the interval's start;
/// `duration` is that of the interval and `substep` that of the whole sub-step [s]: a body that turns by more
/// than a radian in a sub-step tumbles, and is not followed. A normal that turns too fast to be predicted
/// (sharp corners that pass each other) stays as it is, with the arms of the start.
ContactMotion contact_motion(const Body& a, const Body& b, const Manifold& m, const ContactFrame& frame,
                             const Vec3& place, Real duration, Real substep);

/// Where the feature of a body that touches something at a point is when the body turns from one orientation
/// to another: the arm from the centre of mass. Corners turn with the body; points of spheres, caps, rims and
/// round sides stay on the side that faces the other body, whose direction is `out` (unit, world) before and
/// after.
Vec3 turned_arm(const Body& body, const Vec3& arm, const Quat& from, const Vec3& out_from, const Quat& to,
                const Vec3& out_to);

}  // namespace offstage::sim
