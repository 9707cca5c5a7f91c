#include "sim/collision/group_tree.h"

#include <algorithm>

namespace offstage::sim {
namespace {

IndexPair ordered_members(uint32_t a, uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

GroupTree::GroupTree(std::span<const uint32_t> members)
    : members_(members.size()), boxes_(2 * members.size()) {
  place(1, members, 0);
}

/// Places the members, in their order, into the leaves below `node` from left to right. Returns the index of
/// the first member that is not placed yet.
std::size_t GroupTree::place(std::size_t node, std::span<const uint32_t> members, std::size_t next) {
  if (is_leaf(node)) {
    members_[node - members.size()] = members[next];
    return next + 1;
  }
  return place(2 * node + 1, members, place(2 * node, members, next));
}

void GroupTree::refit(std::span<const Aabb> boxes) {
  for (std::size_t i = boxes_.size() - 1; i > 0; --i)
    boxes_[i] = is_leaf(i) ? boxes[member(i)] : boxes_[2 * i].merged(boxes_[2 * i + 1]);
}

void GroupTree::find_own_pairs(std::vector<IndexPair>& pairs) const {
  find_within(1, pairs);
}

void GroupTree::find_within(std::size_t node, std::vector<IndexPair>& pairs) const {
  if (is_leaf(node)) return;
  find_within(2 * node, pairs);
  find_within(2 * node + 1, pairs);
  find_between(2 * node, *this, 2 * node + 1, pairs);
}

void GroupTree::find_pairs(const GroupTree& other, std::vector<IndexPair>& pairs) const {
  find_between(1, other, 1, pairs);
}

/// Appends the pairs between two subtrees. The larger of the two nodes is replaced by its children first.
void GroupTree::find_between(std::size_t node, const GroupTree& other, std::size_t other_node,
                             std::vector<IndexPair>& pairs) const {
  const Aabb &box = boxes_[node], &other_box = other.boxes_[other_node];
  if (!box.intersects(other_box)) return;
  const bool is_end = is_leaf(node), is_other_end = other.is_leaf(other_node);
  if (is_end && is_other_end) {
    pairs.push_back(ordered_members(member(node), other.member(other_node)));
  } else if (is_other_end || (!is_end && box.sizes().sum() > other_box.sizes().sum())) {
    find_between(2 * node, other, other_node, pairs);
    find_between(2 * node + 1, other, other_node, pairs);
  } else {
    find_between(node, other, 2 * other_node, pairs);
    find_between(node, other, 2 * other_node + 1, pairs);
  }
}

void GroupTree::find_pairs(uint32_t object, const Aabb& box, std::vector<IndexPair>& pairs) const {
  const auto visit = [&](const auto& self, std::size_t node) -> void {
    if (!boxes_[node].intersects(box)) return;
    if (is_leaf(node)) {
      pairs.push_back(ordered_members(member(node), object));
    } else {
      self(self, 2 * node);
      self(self, 2 * node + 1);
    }
  };
  visit(visit, 1);
}

}  // namespace offstage::sim
