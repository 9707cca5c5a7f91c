#pragma once
/// Estimates volumes of convex hulls, for comparisons. This is much faster than computing the hulls.

#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

/// The extreme points in about `directions` directions spread evenly, each once, in their order.
std::vector<Vec3> extreme_points(std::span<const Vec3> points, int directions);

/// Volume of the hull of some points; 0 if it is flat. Points that are outside of a face of the growing hull
/// by less than 1e-9 of the extent do not enlarge it. Of more than 160 points, only the points that are
/// extreme in 96 directions count, so the result is too small: by up to a few percent for round sets. [m^3]
Real sketched_hull_volume(std::span<const Vec3> points);

}  // namespace offstage::sim
