#pragma once
/// Convex hulls (physics H4), computed by Qhull: Barber, Dobkin, Huhdanpaa, "The Quickhull algorithm for
/// convex hulls" (1996).

#include <span>

#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

/// The hull of any number of points, at least one. Duplicate, coplanar and collinear points are welcome: a
/// flat set gives a polygon, a straight one a segment, equal points a point (see ConvexPolyhedron). Flat
/// means thinner than 1e-9 of its extent. Neighbouring faces in one plane (within 1e-10 of the extent) are
/// one polygon, and what lies inside a face or an edge is dropped. Vertices keep the order of the points.
ConvexPolyhedron convex_hull(std::span<const Vec3> points);

}  // namespace offstage::sim
