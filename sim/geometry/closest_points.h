#pragma once
/// Closest points of segments, triangles and planes (physics H7). Results are well defined for all degenerate
/// input: a segment may be a point, a triangle may be a segment or a point, and parallel objects give one of
/// their many closest pairs. Small angles between directions are computed by cross products, whose relative
/// error is proportional to 1 / angle. With differences of squares it would be proportional to 1 / angle^2.

#include <array>

#include "sim/core/types.h"
#include "sim/geometry/intersection.h"

namespace offstage::sim {

/// A pair of closest points, one on each of two objects.
struct ClosestPoints {
  Vec3 on_a, on_b;
  Real squared_distance;  ///< [m^2]; 0 for triangles that intersect (intersection.h)
};

/// Projection of a point on a triangle.
struct TrianglePoint {
  Vec3 point;
  std::array<Real, 3>
      weights;  ///< barycentric; exactly 0 for vertices that do not belong to the closest feature
};
TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

/// Returns the fraction, from 0 to 1, of the segment from a to b at which it is nearest to p.
Real closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b);

ClosestPoints closest_on_segments(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1);

/// Returns the point of the segment from p to q nearest to the plane n.x = offset (`n` is a unit vector), and
/// the projection of this point on the plane. If the segment crosses the plane, both are the crossing point.
ClosestPoints closest_segment_plane(const Vec3& p, const Vec3& q, const Vec3& n, Real offset);

ClosestPoints closest_on_triangles(const TriangleVertices& a, const TriangleVertices& b);

}  // namespace offstage::sim
