#pragma once
/// Simple polygons in the plane, for the caps of a solid that is cut.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

using Vec2 = Eigen::Vector2d;

/// Whether p is inside a simple polygon and farther than `margin` from its sides.
bool well_inside(std::span<const Vec2> polygon, const Vec2& p, Real margin);

/// Divides a counter-clockwise polygon into convex polygons by diagonals, at most one for each reflex vertex.
/// Returns the vertex indices of each part, counter-clockwise; empty if the method fails because no diagonal
/// is possible. The outline may touch itself at vertices but must not cross itself. Vertices in the middle of
/// a straight side remain vertices of all adjacent parts. Distances below `tolerance` count as zero.
std::vector<std::vector<uint32_t>> convex_pieces(std::span<const Vec2> polygon, Real tolerance);

}  // namespace offstage::sim
