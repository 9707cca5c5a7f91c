#pragma once
/// The convex hull of a few points, for fitting oriented boxes to the hundreds of thousands of nodes of a
/// tree, for which Qhull would take minutes. Only the directions of the boxes depend on it, not which points
/// they contain, so it is not robust against rounding beyond staying within its bounds; convex_hull.h is.

#include <array>
#include <cstdint>
#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

inline constexpr std::size_t kSmallHullPoints = 24;

/// Covariance of the surface of the convex hull of 1 to kSmallHullPoints points, about its own centre and
/// weighted by area (physics H). For flat sets it is that of their polygon; for straight sets some matrix
/// with their direction as its last eigenvector; for equal points zero.
Mat3 hull_covariance(std::span<const Vec3> points);

}  // namespace offstage::sim
