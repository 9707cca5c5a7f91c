#pragma once
/// Broad phase (physics H5, H6, E9): finds the pairs of objects whose boxes overlap, with a uniform or
/// multi-level Grid.
///
/// Objects at rest can become settled. Settled objects are in a separate grid, which is kept from step to
/// step together with their pairs. All other objects are inserted into a second grid at every step, and only
/// these cost time. Work for an unsettled object that did not move is wasted. When the wasted work has
/// reached the cost of settling all objects at rest, these objects are settled together. Therefore the work
/// is within a small factor of the optimum for any motion, and static objects eventually cost nothing.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/collision/grid.h"

namespace offstage::sim {

class BroadPhase {
 public:
  /// `means_in_cell`: width of a cell of the uniform grid as a multiple of the objects' mean diameter; > 0.
  explicit BroadPhase(GridKind kind = GridKind::multilevel, Real means_in_cell = CellSizes::kMeansInCell)
      : means_in_cell_(means_in_cell) {
    sizes_.kind = kind;
  }

  /// Adds an object. `object`: index chosen by the caller, less than CellTable::kMaxObjects; memory is
  /// proportional to the greatest index. `box`: any box that contains the object, for example a swept one. It
  /// may be a point or infinite, but not empty or NaN.
  void insert(uint32_t object, const Aabb& box, bool is_static = false);
  /// Changes the box of an object. Objects that did not move need no call. Static objects may be moved, too.
  void move(uint32_t object, const Aabb& box);
  void remove(uint32_t object);
  bool contains(uint32_t object) const { return object < states_.size() && (states_[object] & kLive); }

  /// Returns all pairs of objects whose boxes have a common point, except pairs of two static objects. Each
  /// pair occurs once, in ascending order. The result depends on the boxes alone, not on threads or earlier
  /// calls, and is valid until the next call.
  std::span<const IndexPair> pairs();

  /// Work of the last call of pairs(), as counts.
  struct Work {
    std::size_t entered = 0;   ///< objects inserted because they may have moved
    std::size_t copies = 0;    ///< copies of the inserted objects in cells
    std::size_t compared = 0;  ///< pairs of boxes compared
    std::size_t settled = 0;   ///< objects in the rebuilt grid of objects at rest; 0 if it was not rebuilt
  };
  const Work& work() const { return work_; }

 private:
  enum State : uint8_t { kLive = 1, kStatic = 2, kMoved = 4, kUnsettled = 8 };

  bool is_settled(uint32_t object) const { return (states_[object] & (kLive | kUnsettled)) == kLive; }
  void unsettle(uint32_t object);
  void count_diameter(uint32_t object, Real sign);
  void fit_uniform_width();
  template <class Find>
  void search(std::size_t jobs, Find&& find);
  void find_among_moving();
  void find_with_resting();
  void find_large();
  void collect();
  void settle_if_due();

  CellSizes sizes_;
  Real means_in_cell_;
  std::size_t count_ = 0;  // number of objects
  Real diameters_ = 0;     // sum of the diameters of bounded objects [m]
  Real bounded_ = 0;       // number of bounded objects

  std::vector<Aabb> boxes_;          // by object
  std::vector<uint8_t> states_;      // by object, bits of State
  std::vector<uint32_t> unsettled_;  // unsettled objects, and removed ones until the next pairs()
  Grid moving_, resting_;            // grids of the unsettled and of the settled objects
  std::size_t in_vain_ = 0;          // insertions of objects that did not move, since the last settling

  std::vector<CandidatePairs> blocks_;  // results of the parallel jobs
  std::size_t block_count_ = 0;
  std::vector<IndexPair> pairs_, found_, merged_;
  std::vector<uint32_t> begin_;  // start of the pairs of each object in found_
  Work work_;
};

}  // namespace offstage::sim
