#pragma once
/// Merging of convex parts, at the price of some additional volume.

#include <vector>

#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

/// Volume of a convex polyhedron; 0 if it is flat. [m^3]
Real hull_volume(const ConvexPolyhedron& p);

/// Replaces two parts by their common hull, those with the least additional volume first, while there are
/// more than `max_parts` and then while the additional volume of all mergers together is at most `room`
/// [m^3]. Parts whose boxes are separate are merged last.
std::vector<ConvexPolyhedron> merge_hulls(std::vector<ConvexPolyhedron> parts, std::size_t max_parts,
                                          Real room);

}  // namespace offstage::sim
