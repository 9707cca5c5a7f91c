#pragma once
/// The simplices of GJK, and its distance sub-algorithm by signed volumes (after Montanari, Petrinic,
/// Barbieri, 2017). The signs of the origin's barycentric coordinates determine which faces can contain the
/// nearest point. Only differences from one corner are used, so a small simplex far from the origin is as
/// accurate as its corners.

#include <array>

#include "sim/collision/minkowski.h"

namespace offstage::sim {

/// Up to four points of A - B.
struct Simplex {
  std::size_t size = 0;
  std::array<SupportPoint, 4> points;
};

/// The point of a simplex that is nearest to the origin. It is a weighted mean of the corners of the face
/// that contains it.
struct SimplexPoint {
  Vec3 v = Vec3::Zero();
  Real squared = std::numeric_limits<Real>::infinity();  ///< |v|^2
  /// Number of corners of that face; 4 means that the origin is inside the simplex.
  std::size_t size = 0;
  std::array<uint8_t, 4> corner{};
  std::array<Real, 4> weight{};

  /// Returns the point of A's core that belongs to this point of A - B.
  Vec3 on_a(const Simplex& s) const;
};

/// Returns the point of a simplex of 1-4 points that is nearest to the origin. If the point is on an edge
/// within rounding, the triangle is preferred to the edge, because a triangle's normal is accurate even if
/// the origin is very near.
SimplexPoint nearest_point(const Simplex& s);
SimplexPoint nearest_on_triangle(const Vec3& p, const Vec3& q, const Vec3& r);

/// Removes the corners with weight 0; the others are renumbered 0, 1, ...
void reduce(Simplex& s, SimplexPoint& p);

}  // namespace offstage::sim
