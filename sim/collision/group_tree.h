#pragma once
/// Bounding tree of a group of objects, such as the links of an articulation (physics A2). It is a balanced
/// tree whose leaves are the boxes of the objects. The order of the leaves is given by the caller, so that
/// each branch can be a connected part of the group. The tree is refitted when the objects move, and never
/// rebuilt.

#include <span>
#include <vector>

#include "sim/collision/cell_table.h"
#include "sim/core/types.h"

namespace offstage::sim {

class GroupTree {
 public:
  /// Builds the tree of the objects with these indices, of which there must be at least one.
  explicit GroupTree(std::span<const uint32_t> members);

  std::span<const uint32_t> members() const { return members_; }
  /// Updates the tree to the current boxes, which are indexed by object.
  void refit(std::span<const Aabb> boxes);
  const Aabb& bounds() const { return boxes_[1]; }

  // The next functions append the pairs of objects whose boxes have a common point. The lesser index comes
  // first in each pair.
  void find_own_pairs(std::vector<IndexPair>& pairs) const;
  void find_pairs(uint32_t object, const Aabb& box, std::vector<IndexPair>& pairs) const;
  void find_pairs(const GroupTree& other, std::vector<IndexPair>& pairs) const;

 private:
  bool is_leaf(std::size_t node) const { return node >= members_.size(); }
  uint32_t member(std::size_t leaf) const { return members_[leaf - members_.size()]; }
  std::size_t place(std::size_t node, std::span<const uint32_t> members, std::size_t next);
  void find_within(std::size_t node, std::vector<IndexPair>& pairs) const;
  void find_between(std::size_t node, const GroupTree& other, std::size_t other_node,
                    std::vector<IndexPair>& pairs) const;

  std::vector<uint32_t> members_;  // members in the order of the leaves
  std::vector<Aabb> boxes_;  // node i has the children 2 i and 2 i + 1; the root is 1, the leaves come last
};

}  // namespace offstage::sim
