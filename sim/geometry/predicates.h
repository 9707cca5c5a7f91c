#pragma once
/// Orientation of points relative to a line or a plane, exact for the given coordinates. A floating-point
/// value is used if its rounding error provably cannot change its sign; otherwise the determinant is summed
/// exactly. After Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
/// predicates" (1997). They are exact unless a product of three coordinates under- or overflows (below 1e-90,
/// above 1e90).

#include "sim/core/types.h"

namespace offstage::sim {

/// Six times the signed volume of the tetrahedron a, b, c, d: positive if d is on the side to which
/// (b-a)x(c-a) points, zero exactly if the four points are coplanar. The sign is exact; the value is rounded.
Real orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Twice the signed area of the triangle a, b, c: positive if counter-clockwise, zero exactly if collinear.
Real orient2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

/// The plane through three points, for several calls of orient3d(a, b, c, .). The object keeps references to
/// the points.
class OrientedPlane {
 public:
  OrientedPlane(const Vec3& a, const Vec3& b, const Vec3& c);
  /// Returns orient3d(a, b, c, d).
  Real side(const Vec3& d) const;

 private:
  const Vec3 &a_, &b_, &c_;
  Vec3 normal_, magnitude_;
};

}  // namespace offstage::sim
