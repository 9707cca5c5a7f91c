#pragma once
/// Triangulates the polygons of model files. The ear clipping of assimp creates triangles of zero area from
/// three collinear corners. Later steps remove such triangles, so that solids have holes and cannot be
/// divided exactly into convex parts.

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace offstage::render {

/// Returns the triangles of a simple polygon: three indices of corners each, with the winding order of the
/// polygon. No triangle has zero area. The ear that is nearest to an equilateral triangle is cut first.
/// Corners may be collinear, and may lie slightly outside of a common plane. Empty if the polygon has no
/// area, intersects itself or has more than 1024 corners.
std::vector<uint32_t> cut_polygon(std::span<const Eigen::Vector3d> corners);

}  // namespace offstage::render
