#pragma once
/// Terms that the exact solver, the fast solver and the solver of impacts share: friction, moving surfaces,
/// the velocity terms of R9, and small rotations.

#include <utility>

#include "sim/collision/contact_frame.h"
#include "sim/contact/contact_pair.h"

namespace offstage::sim {

/// Change of the relative velocity at a contact in an interval of length h that does not depend on the
/// forces, in the contact's frame: the velocity terms of the relative acceleration (R9).
Vec3 velocity_bias(const ContactPair& pair, const PlacedManifold& placed, const ContactPoint& point, Real h);

/// Velocity that conveyors add to the velocity of a relative to b [m/s], world axes.
Vec3 surface_velocity(const ContactPair& pair);

/// Components along n, t and k.
Vec3 in_frame(const ContactFrame& f, const Vec3& v);

/// Coefficients of friction along t and k at a relative velocity u (contact's frame): the static coefficients
/// if the contact does not slide.
std::pair<Real, Real> friction(const PairSurface& surface, const Vec3& u);

/// Reference point of a body's velocities. For kinematic bodies it is that of the interval's end.
Vec3 origin(const Body& body);

/// The inverse inertia in world axes at an orientation.
Mat3 inverse_inertia(const RigidBody& body, const Quat& orientation);

/// Rotation vector (angle times axis) from one orientation to another [rad], for small rotations.
Vec3 rotation_vector(const Quat& from, const Quat& to);

/// Moves a body by a shift [m] and a small rotation vector [rad].
void displace(Body& body, const Vec3& shift, const Vec3& turn);

}  // namespace offstage::sim
