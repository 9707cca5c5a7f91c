#pragma once
/// The simplices that GJK walks on and its distance sub-algorithm, by signed volumes: the signs of the
/// origin's barycentric coordinates say which faces can hold the nearest point (after Montanari, Petrinic,
/// Barbieri, 2017). Nothing but differences from one corner enters, so a small simplex far away is as exact
/// as its corners.

#include <array>

#include "sim/collision/minkowski.h"

namespace offstage::sim {

/// Up to four points of A - B.
struct Simplex {
  std::size_t size = 0;
  std::array<SupportPoint, 4> points;
};

/// The point of a simplex nearest to the origin, as the mean of the corners that it needs.
struct SimplexPoint {
  Vec3 v = Vec3::Zero();
  Real squared = std::numeric_limits<Real>::infinity();  ///< |v|^2
  std::size_t size = 0;                                  ///< 4: the origin is inside
  std::array<uint8_t, 4> corner{};
  std::array<Real, 4> weight{};

  /// The point of A's core that it comes from.
  Vec3 on_a(const Simplex& s) const;
};

/// The nearest point of a simplex of 1-4 points. Three corners are preferred where two would do within
/// rounding, since a triangle's normal is exact however near the origin is.
SimplexPoint nearest_point(const Simplex& s);
SimplexPoint nearest_on_triangle(const Vec3& p, const Vec3& q, const Vec3& r);

/// Drops the corners that the point does not need; its corners become 0, 1, ...
void reduce(Simplex& s, SimplexPoint& p);

}  // namespace offstage::sim
