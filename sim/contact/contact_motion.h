#pragma once
/// Motion of a contact within an interval, predicted from the bodies' motion at its start (physics R9, R11).
///
/// A contact has two arms (vectors from the centres of mass) and a normal n. They change while the bodies
/// move: a corner moves with its body, the lowest point of a rim moves along the rim, and the normal turns
/// with its face or with the line between two centres. With the arms and the normal of the interval's start,
/// a solution is accurate only to first order in the interval, and a rolling coin would stand up or fall.
/// Therefore the impulse acts at the interval's middle, and the contact conditions apply to the velocities at
/// its end. Impulse and angular momentum are then accurate to second order, for bodies that move by the mean
/// of old and new velocity.

#include "sim/collision/contact_frame.h"
#include "sim/collision/manifold.h"
#include "sim/contact/round_surface.h"
#include "sim/dynamics/body.h"

namespace offstage::sim {

/// Geometry of a contact at one time of the interval.
struct ContactPlace {
  Vec3 normal;  ///< unit, from b to a, world
  /// Vectors to the contact from the centres of mass [m], world axes. For a kinematic body the vector starts
  /// at the body's origin.
  Vec3 arm_a, arm_b;
  /// Rotation of the contact points since the interval's start, about the centre of the body whose feature
  /// defines the contact. Points usually turn with the body. On the sides and rims of round bodies they turn
  /// with the meridian that faces the other body.
  Quat turn;
};

struct ContactMotion {
  ContactPlace middle;
  ContactFrame frame;  ///< frame of the contact at the middle of the interval
  /// Change of the relative velocity at the contact due to the rotation of arms and normal, in `frame` (n, t,
  /// k): gain s + bow s^2. Here s is -1 at the start, 0 in the middle and 1 at the end of the interval [m/s].
  Vec3 gain = Vec3::Zero(), bow = Vec3::Zero();
  /// Additional `gain` of the normal velocity at neighbouring points, per metre of distance along the
  /// tangents t and k [1/s].
  Real gain_along_t = 0, gain_along_k = 0;
  bool turns = false;  ///< whether any gain differs from 0
};

/// Whether the feature that defines a contact belongs to body b. The contact moves with this feature.
bool moves_with_b(NormalSource source);

/// Returns the world position of a body's centre of mass at the interval's start or, for a kinematic body,
/// the position of its origin [m].
Vec3 start_centre(const Body& body);

/// Whether contacts may move along a body's surface while the body turns. This requires rims or round sides,
/// and a noticeable rotation within `duration` [s].
bool runs_along(const Body& body, Real duration);

/// Returns the angular speed at which the axis of a cylinder, cone, frustum, tube or torus turns about the
/// normal of a contact of this piece at the interval's start [rad/s]. The lowest point of a tilted rim moves
/// around the rim at this speed, for example on a wobbling coin. Returns 0 if a face or a side lies flat, and
/// for other shapes.
Real rim_speed(const Body& body, uint32_t piece, const Vec3& normal);

/// Predicts the motion of a contact of a manifold. `frame` is the manifold's frame. `place` is the contact's
/// world position at the interval's start, in the middle between both surfaces. `gap` is the distance of the
/// surfaces [m], negative in penetration. `duration` is the length of the interval [s], `substep` the length
/// of the whole sub-step [s]. If a body turns by more than a radian in a sub-step, normal and arms are kept
/// constant. The same holds if the normal would turn too fast to be predicted, for example where two sharp
/// corners pass each other.
ContactMotion contact_motion(const Body& a, const Body& b, const Manifold& m, const ContactFrame& frame,
                             const Vec3& place, Real gap, Real duration, Real substep);

/// Predicts the place of a contact `time` [s] after the interval's start; for the other arguments see
/// contact_motion(). If the normal cannot be predicted, it is kept, and the contact moves with the body that
/// defines it.
ContactPlace contact_place(const Body& a, const Body& b, const Manifold& m, const Vec3& place, Real gap,
                           Real time, Real substep);

/// Returns a contact frame with the normal n: the frame f after the smallest rotation.
ContactFrame turned_frame(const ContactFrame& f, const Vec3& n);

/// Returns the arm from the centre of mass to a contact feature [m] after the body has turned from
/// orientation `from` to orientation `to`. `arm` is the arm before. Corners turn with the body; points of
/// spheres, caps, rims and round sides stay on the side that faces the other body. `out_from` and `out_to`
/// are the directions to the other body (unit, world) before and after.
Vec3 turned_arm(const RoundSurface& surface, const Vec3& arm, const Quat& from, const Vec3& out_from,
                const Quat& to, const Vec3& out_to);

}  // namespace offstage::sim
