#pragma once
/// Motion of a contact within an interval, predicted from the bodies' motion at its start (physics R9, R11).
///
/// A contact has its arms (from the centres of mass) and its normal n. Both change while the bodies move: a
/// corner moves with its body, the lowest point of a rim moves along the rim, and the normal turns with its
/// face or with the line between two centres. A contact solved with the arms and the normal of the interval's
/// start is accurate only to first order in the interval; a rolling coin would then stand up or fall. Here
/// the impulse acts at the interval's middle, and the contact conditions apply to the velocities at its end.
/// Impulse and angular momentum are then accurate to second order, for bodies that move by the mean of old
/// and new velocity.

#include "sim/collision/contact_frame.h"
#include "sim/collision/manifold.h"
#include "sim/dynamics/body.h"

namespace offstage::sim {

/// Position of a contact at one time of the interval.
struct ContactPlace {
  Vec3 normal;  ///< unit, from b to a, world
  /// Vectors from the bodies' centres of mass (of kinematic bodies: their origins) to the contact [m].
  Vec3 arm_a, arm_b;
  /// Rotation, since the interval's start, of the contact points of the body whose feature defines the
  /// contact. They turn with the body, or, on the sides and rims of round bodies, with the meridian that
  /// faces the other body.
  Quat turn;
};

struct ContactMotion {
  ContactPlace middle;
  ContactFrame frame;  ///< frame of the contact at the middle of the interval
  /// Change of the relative velocity at the contact due to the rotation of arms and normal alone, in `frame`
  /// (n, t, k): gain s + bow s^2, where s increases from -1 at the start through 0 in the middle to 1 at the
  /// end [m/s].
  Vec3 gain = Vec3::Zero(), bow = Vec3::Zero();
  /// Gain of the normal velocity at points beside it, per metre along the tangents t and k [1/s].
  Real gain_along_t = 0, gain_along_k = 0;
  bool turns = false;  ///< whether any gain differs from 0
};

/// Whether the feature that defines a contact, and with which it moves, belongs to b.
bool moves_with_b(NormalSource source);

/// Position of a body's centre of mass at the interval's start; of a kinematic body, its origin.
Vec3 start_centre(const Body& body);

/// Whether contacts may move along a body's surface while it turns: it has rims or round sides and turns
/// noticeably within `duration` [s].
bool runs_along(const Body& body, Real duration);

/// Angular speed at the interval's start at which the axis of a cylinder, cone or frustum turns about the
/// normal of a contact [rad/s]. The lowest point of a tilted rim moves around the rim at this speed, as that
/// of a wobbling coin does. 0 if a face or a side lies flat, and for other shapes.
Real rim_speed(const Body& body, const Vec3& normal);

/// Predicts the motion of a contact of a manifold. `frame` is the manifold's frame and `place` the contact's
/// position in the world at the interval's start, in the middle between surfaces that are `gap` apart [m]
/// (negative: they overlap); `duration` is the length of the interval and `substep` that
/// of the whole sub-step [s]. Contacts of bodies that turn by more than a radian in a sub-step are not
/// predicted. A normal that turns too fast to be predicted, as between sharp corners that pass each other, is
/// kept constant, with the arms of the start.
ContactMotion contact_motion(const Body& a, const Body& b, const Manifold& m, const ContactFrame& frame,
                             const Vec3& place, Real gap, Real duration, Real substep);

/// Arm from the centre of mass to a contact feature of a body after the body has turned from one orientation
/// to another. Corners turn with the body; points of spheres, caps, rims and round sides stay on the side
/// that faces the other body. `out_from` and `out_to` are the directions to the other body (unit, world)
/// before and after.
Vec3 turned_arm(const Body& body, const Vec3& arm, const Quat& from, const Vec3& out_from, const Quat& to,
                const Vec3& out_to);

}  // namespace offstage::sim
