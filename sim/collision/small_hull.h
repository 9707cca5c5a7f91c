#pragma once
/// The convex hull of a few points, for fitting oriented boxes to the hundreds of thousands of nodes of a
/// tree, for which Qhull would take minutes. Only the directions of the boxes depend on this hull; they
/// contain all points in any case. Therefore it need not be robust against rounding, unlike convex_hull.h.

#include <array>
#include <cstdint>
#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

inline constexpr std::size_t kSmallHullPoints = 24;

/// Covariance of the surface of the convex hull of 1 to kSmallHullPoints points, about its own centre and
/// weighted by area (physics H). For coplanar points it is the covariance of their polygon. For collinear
/// points it is a matrix whose last eigenvector is along the line. For equal points it is zero.
Mat3 hull_covariance(std::span<const Vec3> points);

}  // namespace offstage::sim
