#pragma once
/// Estimates volumes of convex hulls, for comparisons. This is much faster than computing the hulls.

#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

/// Returns the points that are extreme in about `directions` evenly distributed directions, each once and in
/// the given order.
std::vector<Vec3> extreme_points(std::span<const Vec3> points, int directions);

/// Returns an estimate of the volume of the convex hull of some points [m^3]; 0 if it is flat. Points that
/// are outside of the growing hull by less than 1e-9 of the extent are ignored. If there are more than 160
/// points, only those that are extreme in 96 directions are used; the result is then too small, by up to a
/// few percent for round sets.
Real sketched_hull_volume(std::span<const Vec3> points);

}  // namespace offstage::sim
