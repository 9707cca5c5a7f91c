#pragma once
/// The convex hull of a few points, for fitting oriented boxes to the nodes of a tree. A tree may have
/// hundreds of thousands of nodes, for which Qhull would take minutes. Only the axes of a box depend on this
/// hull, and the box contains all points in any case. Therefore the hull need not be robust against rounding,
/// unlike convex_hull.h.

#include <array>
#include <cstdint>
#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

inline constexpr std::size_t kSmallHullPoints = 24;

/// Returns the covariance of the surface of the convex hull of 1 to kSmallHullPoints points. It is weighted
/// by area and relative to the centre of the surface (physics H). For coplanar points it is the covariance of
/// their polygon. For collinear points it is a matrix whose last eigenvector is along the line. For equal
/// points it is zero.
Mat3 hull_covariance(std::span<const Vec3> points);

}  // namespace offstage::sim
