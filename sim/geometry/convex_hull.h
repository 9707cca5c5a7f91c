#pragma once
/// Convex hulls (physics H4), computed by Qhull: Barber, Dobkin, Huhdanpaa, "The Quickhull algorithm for
/// convex hulls" (1996).

#include <span>

#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

/// Returns the hull of at least one point. Duplicate, coplanar and collinear points are allowed: a flat set
/// gives a polygon, a straight one a segment, and equal points a point (see ConvexPolyhedron). Flat means
/// thinner than 1e-9 of the extent. Neighbouring faces in one plane (within 1e-10 of the extent) become one
/// polygon, and vertices inside a face or an edge are removed. Vertices keep the order of the points.
ConvexPolyhedron convex_hull(std::span<const Vec3> points);

}  // namespace offstage::sim
