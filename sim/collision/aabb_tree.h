#pragma once
/// Binary tree of axis-aligned boxes over any items that have one (physics H1), built top-down: split at the
/// mean of the items' midpoints along the longest axis, at the median where the mean is unbalanced, along
/// another axis where all midpoints coincide, and into a leaf of several items where no axis separates them.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "sim/types.h"

namespace offstage::sim {

class AabbTree {
 public:
  AabbTree() = default;
  explicit AabbTree(std::span<const Aabb> boxes);

  /// Box of everything; empty if there are no items.
  Aabb bounds() const { return nodes_.empty() ? Aabb() : nodes_.front().box; }

  /// Calls visit(item) for every item in a leaf whose box meets `query`, in an order that depends on the tree
  /// alone.
  template <class Visit>
  void overlapping(const Aabb& query, Visit&& visit) const {
    for (uint32_t i = 0; i < nodes_.size();) {
      const Node& node = nodes_[i];
      if (!node.box.intersects(query)) {
        i = node.next;
        continue;
      }
      for (uint32_t k = 0; k < node.count; ++k) visit(items_[node.first + k]);
      ++i;
    }
  }

  /// Branch and bound: calls distance2(item), the squared distance of an item to p, for every item that can
  /// be nearer than the least value seen so far, starting from `limit2`. Nearer boxes first.
  template <class Distance2>
  void nearest(const Vec3& p, Distance2&& distance2,
               Real limit2 = std::numeric_limits<Real>::infinity()) const {
    if (!nodes_.empty()) nearest_below(0, p, distance2, limit2);
  }

 private:
  /// Nodes lie in depth-first order: a branch's first child follows it, and `next` is where its subtree ends.
  struct Node {
    Aabb box;
    uint32_t next = 0;
    uint32_t first = 0, count = 0;  // range of items_; a branch has none
  };

  template <class Distance2>
  void nearest_below(uint32_t i, const Vec3& p, Distance2& distance2, Real& best2) const {
    const Node& node = nodes_[i];
    for (uint32_t k = 0; k < node.count; ++k) best2 = std::min(best2, distance2(items_[node.first + k]));
    if (node.count > 0) return;
    uint32_t near = i + 1, far = nodes_[near].next;
    Real near2 = nodes_[near].box.squaredExteriorDistance(p),
         far2 = nodes_[far].box.squaredExteriorDistance(p);
    if (far2 < near2) {
      std::swap(near, far);
      std::swap(near2, far2);
    }
    if (near2 <= best2) nearest_below(near, p, distance2, best2);
    if (far2 <= best2) nearest_below(far, p, distance2, best2);
  }

  std::size_t split(std::span<const Aabb> boxes, std::size_t begin, std::size_t end);
  void build(std::span<const Aabb> boxes, std::size_t begin, std::size_t end);

  std::vector<Node> nodes_;
  std::vector<uint32_t> items_;
};

}  // namespace offstage::sim
