#pragma once
/// The convex hull of a few points, for fitting oriented boxes to the hundred thousands of nodes of a tree,
/// where Qhull would take minutes. Only the directions of the boxes depend on it, never what they hold, so it
/// does not defend itself against rounding beyond staying within its bounds; convex_hull.h does.

#include <array>
#include <cstdint>
#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

inline constexpr std::size_t kSmallHullPoints = 24;

/// Covariance of the surface of the convex hull of at most kSmallHullPoints points, at least one, about its
/// own centre and weighted by area (physics H). Of flat sets that of their polygon; of straight ones some
/// matrix with their direction as its last eigenvector; of equal points zero.
Mat3 hull_covariance(std::span<const Vec3> points);

}  // namespace offstage::sim
