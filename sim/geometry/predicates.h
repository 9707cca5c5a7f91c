#pragma once
/// On which side of a line or a plane a point lies, decided exactly for the coordinates as given. A
/// floating-point value whose rounding error provably cannot change its sign is used where it suffices; else
/// the determinant is summed without error. After Shewchuk, "Adaptive precision floating-point arithmetic and
/// fast robust geometric predicates" (1997). Exact unless a product of three coordinates under- or overflows
/// (below 1e-90, above 1e90).

#include "sim/core/types.h"

namespace offstage::sim {

/// Six times the signed volume of the tetrahedron a, b, c, d: positive if d is on the side to which
/// (b-a)x(c-a) points, zero exactly if the four are coplanar. The sign is exact; the size is rounded.
Real orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Twice the signed area of the triangle a, b, c: positive if counter-clockwise, zero exactly if collinear.
Real orient2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

/// The plane through three points for several orient3d(a, b, c, .) in a row. Refers to the points.
class OrientedPlane {
 public:
  OrientedPlane(const Vec3& a, const Vec3& b, const Vec3& c);
  /// orient3d(a, b, c, d).
  Real side(const Vec3& d) const;

 private:
  const Vec3 &a_, &b_, &c_;
  Vec3 normal_, magnitude_;
};

}  // namespace offstage::sim
