#pragma once
/// Closest points of segments, triangles and planes (physics H7). Answers are well defined for everything
/// degenerate: a segment may be a point, a triangle a segment or a point, and parallel ones give one of their
/// many closest pairs. Where a direction is a small difference it is computed by cross products, whose
/// relative error grows with the inverse of the angle and not, as for differences of squares, of the angle
/// squared.

#include <array>

#include "sim/core/types.h"
#include "sim/geometry/intersection.h"

namespace offstage::sim {

/// A pair of closest points, one on each of two things.
struct ClosestPoints {
  Vec3 on_a, on_b;
  Real squared_distance;  ///< [m^2]; 0 for triangles that intersect (intersection.h)
};

/// Where a point's projection on a triangle lies.
struct TrianglePoint {
  Vec3 point;
  std::array<Real, 3> weights;  ///< barycentric; exactly 0 for the vertices that the closest feature excludes
};
TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

/// The point of the segment from a to b nearest to p, as the fraction of the way from a to b.
Real closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b);

ClosestPoints closest_on_segments(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1);

/// The point of a segment nearest to the plane n.x = offset, `n` unit, and its projection; the point where it
/// crosses the plane if it does.
ClosestPoints closest_segment_plane(const Vec3& p, const Vec3& q, const Vec3& n, Real offset);

ClosestPoints closest_on_triangles(const TriangleVertices& a, const TriangleVertices& b);

}  // namespace offstage::sim
