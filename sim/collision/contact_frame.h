#pragma once
/// The frame of a contact and its rotation with the bodies (physics R11). Resting contact needs the second
/// derivative of the gap, which contains the time derivatives of the normal and the tangents. All vectors are
/// in one frame that does not turn; rotate the vectors first if a manifold is in the frame of a body.

#include "sim/collision/manifold.h"
#include "sim/core/twist.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// Right-handed orthonormal axes: the normal n, and the tangents t and k = n x t. The type also serves for
/// the time derivatives of these axes [1/s].
struct ContactFrame {
  Vec3 n, t, k;

  /// Returns the components of a vector along n, t and k.
  Vec3 components(const Vec3& v) const { return {n.dot(v), t.dot(v), k.dot(v)}; }
  /// Returns the vector with these components.
  Vec3 vector(const Vec3& p) const { return p.x() * n + p.y() * t + p.z() * k; }
};

/// Returns the frame of a unit normal. The tangent t is the normal with its smallest component set to zero,
/// the other two exchanged and one of them negated. It is a smooth function of n except where another
/// component becomes the smallest.
ContactFrame contact_frame(const Vec3& n);

/// Returns the time derivative of contact_frame(n). `n_rate`: time derivative of n, perpendicular to n [1/s].
ContactFrame contact_frame_rate(const ContactFrame& frame, const Vec3& n_rate);

/// Returns the time derivative of the manifold's normal at one of its points while A and B move [1/s]. It
/// depends on the features that define the normal (NormalSource), and includes the sliding of the contact
/// over the surfaces. The result is exact for faces, straight edges, vertices, spheres, cylinders and cones;
/// for a rim, its tangent line is used. If the direction between the features is undefined because they
/// coincide, the normal turns with the mean angular velocity of both bodies.
Vec3 normal_rate(const Manifold& m, const ContactPoint& point, const Twist& a, const Twist& b);

}  // namespace offstage::sim
