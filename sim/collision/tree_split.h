#pragma once
/// How the items of a bounding tree are parted, whatever its volumes.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

/// How the items of a node are parted in two.
enum class TreeSplit : uint8_t {
  /// At the mean of the midpoints along the longest axis, at their median where the mean is unbalanced, along
  /// another axis where all midpoints coincide: the book's.
  mean,
  /// Where the surface area heuristic says that queries cost least, among 16 bins along each axis: Wald, "On
  /// fast construction of SAH-based bounding volume hierarchies" (2007).
  surface_area,
};

/// No node of a tree is deeper, so that a traversal needs no more than a fixed stack.
inline constexpr uint32_t kMaxTreeDepth = 64;

struct TreeItem {
  Aabb box;
  Vec3 midpoint;
  uint32_t index;
};

/// A node without its volume, see BoundingTree::Node.
struct TreeRange {
  uint32_t size, first, count;
};

/// The nodes of a tree in depth-first order, and the items in the order of its leaves. A leaf has one item,
/// or several whose midpoints coincide. The same for any number of threads.
std::vector<TreeRange> split_tree(std::span<TreeItem> items, TreeSplit split);

}  // namespace offstage::sim
