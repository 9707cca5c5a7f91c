#pragma once
/// Terms that the exact solver, the fast solver and the solver of impacts share: friction, moving surfaces,
/// the velocity terms of R9, and small rotations.

#include <utility>

#include "sim/collision/contact_frame.h"
#include "sim/contact/contact_pair.h"
#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Returns the change of the relative velocity at a contact in an interval of length h [s] that does not
/// depend on forces: the velocity terms of the relative acceleration (physics R9), times h. Components in the
/// contact's frame [m/s].
Vec3 velocity_bias(const ContactPair& pair, const PlacedManifold& placed, const ContactPoint& point, Real h);

/// Velocity that conveyors add to the velocity of a relative to b at a contact with the normal n [m/s], world
/// axes. A conveyor moves along its surface, so the velocity has no component along n.
Vec3 surface_velocity(const ContactPair& pair, const Vec3& n);

/// Returns the coefficients of friction along t and k for a relative velocity u in the contact's frame [m/s].
/// If the contact does not slide, they are the static coefficients.
std::pair<Real, Real> friction(const PairSurface& surface, const Vec3& u);

/// Returns the world position of the point to which a body's velocity refers [m]: the centre of mass or, for
/// a kinematic body, its origin at the interval's end.
Vec3 origin(const Body& body);

/// Returns the ContactBody of a body that contacts do not move: asleep, static or kinematic. The exact solver
/// and the impact solver use it.
ContactBody unmoved_body(const Body& body);

/// The inverse inertia in world axes at an orientation.
Mat3 inverse_inertia(const RigidBody& body, const Quat& orientation);

/// Rotation vector (angle times axis) from one orientation to another [rad], for small rotations.
Vec3 rotation_vector(const Quat& from, const Quat& to);

/// Effect of the contacts and joints of an interval on a body.
struct IntervalEffect {
  Vec3 impulse, angular_impulse;  ///< [N s], [N m s]
  /// Angular velocity of the free motion at the orientation at which the impulses act, and the expected
  /// change of the angular velocity [rad/s].
  Vec3 free_spin, spin;
  Vec3 shift, turn;  ///< displacement of the centre of mass [m] and small rotation vector [rad]
  Real fraction;     ///< length of the interval divided by the length of the sub-step
};

/// Adds the effect of an interval to a body in its state at the end of the free motion.
///
/// The angular momentum is exact, while the orientation is known to second order in the interval. For a thin
/// body the difference may be a large rotation about its axis, with an energy that no force has supplied. If
/// the energy of the angular momentum exceeds the energy of the expected angular velocity, the body is turned
/// to an orientation in which both agree. If that orientation is far away, the body gets the expected angular
/// velocity instead.
void add_effect(Body& body, const IntervalEffect& effect);

}  // namespace offstage::sim
