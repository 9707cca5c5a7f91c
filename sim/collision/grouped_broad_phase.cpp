#include "sim/collision/grouped_broad_phase.h"

#include <algorithm>
#include <cassert>

namespace offstage::sim {

void GroupedBroadPhase::insert(uint32_t object, const Aabb& box, bool is_static) {
  assert(!contains(object));
  if (object >= group_of_.size()) {
    group_of_.resize(object + 1, kAbsent);
    boxes_.resize(object + 1);
  }
  group_of_[object] = kAlone;
  boxes_[object] = box;
  grid_.insert(object, box, is_static);
}

void GroupedBroadPhase::move(uint32_t object, const Aabb& box) {
  boxes_[object] = box;
  if (is_grouped(object))
    groups_[group_of_[object]].moved = true;
  else
    grid_.move(object, box);
}

void GroupedBroadPhase::remove(uint32_t object) {
  if (is_grouped(object)) dissolve(group_of_[object]);
  grid_.remove(object);
  group_of_[object] = kAbsent;
}

/// Dissolves a group. Its members are single objects from now on.
void GroupedBroadPhase::dissolve(uint32_t number) {
  groups_[number].is_whole = false;
  const std::span<const uint32_t> members = groups_[number].tree.members();
  grid_.remove(members.front());
  for (uint32_t member : members) {
    grid_.insert(member, boxes_[member]);
    group_of_[member] = kAlone;
  }
}

void GroupedBroadPhase::set_groups(std::span<const std::vector<uint32_t>> groups) {
  for (uint32_t i = 0; i < groups_.size(); ++i)
    if (groups_[i].is_whole) dissolve(i);
  groups_.clear();
  for (const std::vector<uint32_t>& members : groups) {
    if (members.empty()) continue;
    for (uint32_t member : members) {
      assert(contains(member) && !is_grouped(member));
      group_of_[member] = static_cast<uint32_t>(groups_.size());
      grid_.remove(member);
    }
    Group& group = groups_.emplace_back(Group{GroupTree(members)});
    group.tree.refit(boxes_);
    grid_.insert(group.tree.members().front(), group.tree.bounds());
  }
}

std::span<const IndexPair> GroupedBroadPhase::pairs() {
  if (groups_.empty()) return grid_.pairs();
  for (Group& group : groups_) {
    if (!group.moved || !group.is_whole) continue;
    group.moved = false;
    group.tree.refit(boxes_);
    grid_.move(group.tree.members().front(), group.tree.bounds());
    group.own_pairs.clear();
    group.tree.find_own_pairs(group.own_pairs);
  }
  pairs_.clear();
  for (const auto& [a, b] : grid_.pairs()) {
    const Group *of_a = is_grouped(a) ? &groups_[group_of_[a]] : nullptr,
                *of_b = is_grouped(b) ? &groups_[group_of_[b]] : nullptr;
    if (of_a && of_b)
      of_a->tree.find_pairs(of_b->tree, pairs_);
    else if (of_a)
      of_a->tree.find_pairs(b, boxes_[b], pairs_);
    else if (of_b)
      of_b->tree.find_pairs(a, boxes_[a], pairs_);
    else
      pairs_.push_back({a, b});
  }
  for (const Group& group : groups_)
    if (group.is_whole) pairs_.insert(pairs_.end(), group.own_pairs.begin(), group.own_pairs.end());
  std::sort(pairs_.begin(), pairs_.end());
  return pairs_;
}

}  // namespace offstage::sim
