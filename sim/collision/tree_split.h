#pragma once
/// Builds the structure of a bounding tree by splitting its items, independently of the kind of volumes.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

/// Rule by which the items of a node are split in two.
enum class TreeSplit : uint8_t {
  /// Splits at the mean of the midpoints along the longest axis; at their median if the mean is unbalanced;
  /// along another axis if all midpoints coincide. This is the book's rule.
  mean,
  /// Splits where queries cost least according to the surface area heuristic, among 16 bins along each axis:
  /// Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007).
  surface_area,
};

/// Greatest depth of a node. It allows traversals with a stack of fixed size.
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

/// Returns the nodes of a tree in depth-first order, with the items in the order of its leaves. A leaf has
/// one item, or several whose midpoints coincide. The result does not depend on the number of threads.
std::vector<TreeRange> split_tree(std::span<TreeItem> items, TreeSplit split);

}  // namespace offstage::sim
