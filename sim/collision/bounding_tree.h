#pragma once
/// Binary trees of bounding volumes over the triangles of a mesh or, with axis-aligned boxes, over any items
/// that have a box (physics H1-H3). All volumes are in the frame of the mesh; queries transform only the
/// root.

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "sim/collision/bounding_volume.h"
#include "sim/collision/tree_split.h"
#include "sim/core/types.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

template <class Volume>
class BoundingTree {
 public:
  /// Nodes are stored in depth-first order: the first child directly follows its parent, and the second child
  /// follows the subtree of the first.
  struct Node {
    Volume volume;
    uint32_t size;          ///< number of nodes in the subtree, including this one
    uint32_t first, count;  ///< range of items() in the subtree

    bool is_leaf() const { return size == 1; }
  };

  BoundingTree() = default;
  explicit BoundingTree(const TriangleMesh& mesh, TreeSplit split = TreeSplit::surface_area);
  explicit BoundingTree(std::span<const Aabb> boxes,
                        TreeSplit split = TreeSplit::surface_area) requires std::same_as<Volume, Aabb>;

  /// A tree of items that are sets of points, such as the vertices of convex parts. No set may be empty.
  explicit BoundingTree(std::span<const std::span<const Vec3>> items,
                        TreeSplit split = TreeSplit::surface_area);
  /// A tree of one item.
  static BoundingTree of_one(const Volume& volume);

  /// Fits the volumes to the vertices of a mesh with the same triangles, after the vertices have moved.
  /// Oriented boxes keep their axes.
  void refit(const TriangleMesh& mesh);
  void refit(std::span<const Aabb> boxes) requires std::same_as<Volume, Aabb>;

  bool empty() const { return nodes_.empty(); }
  std::span<const Node> nodes() const { return nodes_; }
  std::span<const uint32_t> items() const { return items_; }
  std::span<const uint32_t> items(const Node& node) const { return {items_.data() + node.first, node.count}; }
  const Node& first_child(const Node& branch) const { return *(&branch + 1); }
  const Node& second_child(const Node& branch) const { return *(&branch + 1 + first_child(branch).size); }

  /// Returns the volume of all items; an empty box, or a point at the origin, if there are none.
  Volume bounds() const { return nodes_.empty() ? Volume() : nodes_.front().volume; }
  /// Returns an upper bound of the distance of any item's points from the origin of the frame [m].
  Real reach() const;

  /// Calls visit(level, volume, is_leaf) for every node in depth-first order; the root is at level 0.
  template <class Visit>
  void for_each_node(Visit&& visit) const {
    if (!nodes_.empty()) visit_below(nodes_.front(), 0, visit);
  }

  /// Calls visit(item) for every item in a leaf whose box overlaps `query`. The order depends only on the
  /// tree.
  template <class Visit>
  requires std::same_as<Volume, Aabb>
  void overlapping(const Aabb& query, Visit&& visit) const {
    for (uint32_t i = 0; i < nodes_.size();) {
      const Node& node = nodes_[i];
      if (!node.volume.intersects(query)) {
        i += node.size;
        continue;
      }
      if (node.is_leaf())
        for (uint32_t item : items(node)) visit(item);
      ++i;
    }
  }

  /// Searches for the item that is nearest to p, by branch and bound. The caller records the result in
  /// distance2(). distance2(item) must return the squared distance between an item and p [m^2]. It is called
  /// for every item that may be nearer than the smallest distance so far, which is `limit2` at first. Nearer
  /// boxes are visited first.
  template <class Distance2>
  requires std::same_as<Volume, Aabb>
  void nearest(const Vec3& p, Distance2&& distance2,
               Real limit2 = std::numeric_limits<Real>::infinity()) const {
    if (!nodes_.empty()) nearest_below(nodes_.front(), p, distance2, limit2);
  }

 private:
  template <class Visit>
  void visit_below(const Node& node, uint32_t level, Visit& visit) const {
    visit(level, node.volume, node.is_leaf());
    if (node.is_leaf()) return;
    visit_below(first_child(node), level + 1, visit);
    visit_below(second_child(node), level + 1, visit);
  }

  template <class Distance2>
  void nearest_below(const Node& node, const Vec3& p, Distance2& distance2, Real& best2) const {
    if (node.is_leaf()) {
      for (uint32_t item : items(node)) best2 = std::min(best2, distance2(item));
      return;
    }
    const Node *near = &first_child(node), *far = &second_child(node);
    Real near2 = near->volume.squaredExteriorDistance(p), far2 = far->volume.squaredExteriorDistance(p);
    if (far2 < near2) {
      std::swap(near, far);
      std::swap(near2, far2);
    }
    if (near2 <= best2) nearest_below(*near, p, distance2, best2);
    if (far2 <= best2) nearest_below(*far, p, distance2, best2);
  }

  void build(std::vector<TreeItem> items, TreeSplit split);
  void fit_to(const TriangleMesh& mesh, bool fresh);

  std::vector<Node> nodes_;
  std::vector<uint32_t> items_;
};

extern template class BoundingTree<Aabb>;
extern template class BoundingTree<Obb>;
extern template class BoundingTree<BoundingSphere>;

using AabbTree = BoundingTree<Aabb>;
using ObbTree = BoundingTree<Obb>;
using SphereTree = BoundingTree<BoundingSphere>;

}  // namespace offstage::sim
