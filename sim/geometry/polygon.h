#pragma once
/// Simple polygons in the plane: what capping a cut solid needs.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

using Vec2 = Eigen::Vector2d;

/// Whether p is inside a simple polygon and farther than `margin` from its sides.
bool well_inside(std::span<const Vec2> polygon, const Vec2& p, Real margin);

/// Cuts a counter-clockwise polygon into convex ones along diagonals, at most one per reflex vertex. The
/// outline may touch itself at vertices but not cross itself. Vertices in the middle of a straight side stay
/// vertices of every part they touch. Each part lists indices, counter-clockwise. Distances below `tolerance`
/// count as none; if they leave no diagonal, the result is empty.
std::vector<std::vector<uint32_t>> convex_pieces(std::span<const Vec2> polygon, Real tolerance);

}  // namespace offstage::sim
