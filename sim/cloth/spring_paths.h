#pragma once
/// Divides springs into paths. At each end, a spring is continued by the spring with the smallest change of
/// direction, like a thread in a weave. A sweep follows the paths, so that each point is loaded once for two
/// springs. Several paths are swept at the same time (cloth_springs.h).

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

/// Consecutive springs: spring i is between points i and i + 1.
struct SpringPath {
  std::vector<uint32_t> points;
  std::vector<uint32_t> springs;  ///< indices of springs in the span given to spring_paths()
};

/// Divides the springs into paths, such that each spring is in exactly one. Neighbours in a path are of one
/// kind and meet at an angle of less than 45 degrees in the unstrained cloth. A closed path is cut open.
std::vector<SpringPath> spring_paths(std::span<const ClothSpring> springs, const ClothPoints& points);

/// The number of colours. The last one is for paths that cannot have any of the others.
inline constexpr uint32_t kPathColors = 65;
/// Returns a colour for each path. Paths of one colour share no point, unless it is the last colour.
std::vector<uint32_t> path_colors(std::span<const SpringPath> paths, std::size_t point_count);

}  // namespace offstage::sim
