#pragma once
/// Divides springs into paths. At each end, a spring is followed by the one that continues it most nearly
/// straight, as in the threads of a weave. Sweeps follow the paths, so that each point is loaded once for two
/// springs, and several paths are swept at a time (cloth_springs.h).

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

/// Every spring lies in one path. Neighbours in a path are of one kind and meet at an angle of less than 45
/// degrees in the unstrained cloth. A closed path is cut open.
std::vector<SpringPath> spring_paths(std::span<const ClothSpring> springs, const ClothPoints& points);

/// The number of colours, of which the last is that of paths for which none was left.
inline constexpr uint32_t kPathColors = 65;
/// A colour of each path: paths of one colour, other than the last, share no point.
std::vector<uint32_t> path_colors(std::span<const SpringPath> paths, std::size_t point_count);

}  // namespace offstage::sim
