#pragma once
/// The choice of a bounding tree for the pieces of a shape (physics H1-H3).

#include <cstdint>
#include <variant>

#include "sim/collision/bounding_tree.h"

namespace offstage::sim {

/// Kind of the volumes of a tree.
enum class TreeVolume : uint8_t { aabb, obb, sphere };

struct TreeChoice {
  TreeVolume volume = TreeVolume::aabb;
  TreeSplit split = TreeSplit::surface_area;
  friend auto operator<=>(const TreeChoice&, const TreeChoice&) = default;
};

/// A bounding tree of any kind; the alternatives are in the order of TreeVolume.
using PieceTree = std::variant<AabbTree, ObbTree, SphereTree>;

/// Returns a tree of the chosen kind. `items`: see the constructors of BoundingTree.
template <class Items>
PieceTree make_tree(const Items& items, const TreeChoice& choice) {
  switch (choice.volume) {
    case TreeVolume::obb:
      return ObbTree(items, choice.split);
    case TreeVolume::sphere:
      return SphereTree(items, choice.split);
    case TreeVolume::aabb:
      break;
  }
  return AabbTree(items, choice.split);
}

}  // namespace offstage::sim
