#pragma once
/// Cuts the polygons of model files into triangles. The ear clipping of assimp makes triangles without area
/// from three corners in a line. Later steps drop these triangles, so solids have holes and cannot be divided
/// into convex parts exactly.

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace offstage::render {

/// Returns the triangles of a simple polygon, three indices of corners each, in the polygon's sense of
/// rotation. No triangle has zero area; of all ears the one nearest to an equilateral triangle is cut first.
/// Several corners may lie on one line, and the corners may lie slightly outside of a common plane. Empty if
/// the polygon has no area, crosses itself or has more than 1024 corners.
std::vector<uint32_t> cut_polygon(std::span<const Eigen::Vector3d> corners);

}  // namespace offstage::render
