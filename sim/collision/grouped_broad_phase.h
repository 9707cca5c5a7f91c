#pragma once
/// A broad phase of two levels (physics A2). Each group of objects, such as the links of an articulation, has
/// one box in the grid and a bounding tree. The tree finds pairs among the members, and pairs with objects
/// that overlap the group's box. All other objects are in the grid itself.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/collision/broad_phase.h"
#include "sim/collision/group_tree.h"

namespace offstage::sim {

class GroupedBroadPhase {
 public:
  explicit GroupedBroadPhase(GridKind kind = GridKind::multilevel,
                             Real means_in_cell = CellSizes::kMeansInCell)
      : grid_(kind, means_in_cell) {}

  /// insert(), move() and remove() have the same meaning as the functions of BroadPhase.
  void insert(uint32_t object, const Aabb& box, bool is_static = false);
  void move(uint32_t object, const Aabb& box);
  void remove(uint32_t object);
  bool contains(uint32_t object) const { return object < group_of_.size() && group_of_[object] != kAbsent; }

  /// Sets the groups. Every object of a group must be in the broad phase and must not be static. An object
  /// can be in one group only.
  void set_groups(std::span<const std::vector<uint32_t>> groups);

  /// Returns the same pairs as BroadPhase::pairs() does.
  std::span<const IndexPair> pairs();

 private:
  static constexpr uint32_t kAbsent = UINT32_MAX, kAlone = UINT32_MAX - 1;
  /// A group; it is in the grid under its first member.
  struct Group {
    GroupTree tree;
    bool is_whole = true;  // no member has been removed; otherwise it is no longer treated as a group
    bool moved = true;
    std::vector<IndexPair> own_pairs = {};
  };

  bool is_grouped(uint32_t object) const { return group_of_[object] < kAlone; }
  void dissolve(uint32_t group);

  BroadPhase grid_;
  std::vector<Aabb> boxes_;         // by object
  std::vector<uint32_t> group_of_;  // by object
  std::vector<Group> groups_;
  std::vector<IndexPair> pairs_;
};

}  // namespace offstage::sim
