#pragma once
/// Fewer convex parts for a little more volume.

#include <vector>

#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

/// Volume of a convex polyhedron; 0 if it is flat. [m^3]
Real hull_volume(const ConvexPolyhedron& p);

/// Replaces two parts by their common hull, first those that gain the least volume by it: while there are
/// more than `max_parts`, and while the gain is at most `free_gain` [m^3]. Parts whose boxes are apart come
/// last.
std::vector<ConvexPolyhedron> merge_hulls(std::vector<ConvexPolyhedron> parts, std::size_t max_parts,
                                          Real free_gain);

}  // namespace offstage::sim
