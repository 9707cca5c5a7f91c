#pragma once
/// Intersection tests of points, segments and triangles (physics H7). All are closed sets, so objects that
/// touch count as intersecting. Triangles may be degenerate; they are then segments or points.
///
/// Tests among points, segments and triangles are exact for the given coordinates (predicates.h). They are
/// symmetric, do not depend on the order of vertices, and leave no gap between two triangles that share an
/// edge. Tests against boxes and spheres are rounded, with a relative error of a few units in the last place.

#include <array>

#include "sim/core/types.h"

namespace offstage::sim {

using TriangleVertices = std::array<Vec3, 3>;

bool point_in_triangle(const Vec3& p, const TriangleVertices& t);
bool segments_intersect(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1);
bool segment_intersects_triangle(const Vec3& p, const Vec3& q, const TriangleVertices& t);
/// Whether two triangles intersect, after Guigue and Devillers, "Fast and robust triangle-triangle overlap
/// test using orientation predicates" (2003).
bool triangles_intersect(const TriangleVertices& a, const TriangleVertices& b);

/// Whether a triangle intersects a solid box, by thirteen separating axes (Akenine-Moller, "Fast 3D
/// triangle-box overlap testing", 2001).
bool triangle_intersects_box(const TriangleVertices& t, const Aabb& box);
/// Whether a triangle intersects a solid ball.
bool triangle_intersects_sphere(const TriangleVertices& t, const Vec3& centre, Real radius);

}  // namespace offstage::sim
