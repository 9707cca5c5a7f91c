#pragma once
/// The frame of a contact and how it turns with the bodies (physics R11): resting contact needs the second
/// derivative of the gap, and with it the rates of the normal and of the tangents. Everything is in one
/// frame, at rest or at least not turning; of a manifold that is given in a body's frame, turn the vectors
/// first.

#include "sim/collision/manifold.h"
#include "sim/core/twist.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// Right-handed orthonormal axes: normal and two tangents, k = n x t. Or their time derivatives [1/s].
struct ContactFrame {
  Vec3 n, t, k;
};

/// The frame of a unit normal. The tangent t comes from dropping the smallest component of n, exchanging the
/// other two and negating one: it is a smooth function of n except where another component becomes the
/// smallest.
ContactFrame contact_frame(const Vec3& n);

/// The rate of contact_frame(n) as n changes at `n_rate`, which must be across n.
ContactFrame contact_frame_rate(const ContactFrame& frame, const Vec3& n_rate);

/// The rate of the manifold's normal at one of its points while A and B move, by what the normal comes from.
/// The sliding of the contact over the surfaces is part of it. Exact for faces, straight edges, vertices,
/// spheres, cylinders and cones; a rim turns as its tangent does. Where a point lies on the other body's
/// point or line, so that its direction is undefined, the normal turns with the mean of the bodies.
Vec3 normal_rate(const Manifold& m, const ContactPoint& point, const Twist& a, const Twist& b);

}  // namespace offstage::sim
