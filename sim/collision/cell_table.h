#pragma once
/// One level of a broad-phase grid: equal cubic cells in a hash table (physics H5, H6). What falls into one
/// bucket lies there side by side with a copy of its box, so that a bucket is read straight through; empty
/// space takes no memory. A table is built as a whole by counting sort, which is quicker than changing cells
/// one by one as soon as more than a few objects move.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

/// Two objects by index, the lesser first.
struct IndexPair {
  uint32_t a, b;
  friend auto operator<=>(const IndexPair&, const IndexPair&) = default;
};

/// A box as a point of eight dimensions: A meets B exactly if low(A) <= high(B) and -high(A) <= -low(B),
/// which is one comparison of eight lanes. Rounding to single precision keeps order, so boxes that meet still
/// do, and those that meet with no lane equal met before. The fourth axis tells cells apart: copies that were
/// entered in different cells do not meet.
struct alignas(32) CellBox {
  std::array<float, 8> bound;  ///< low x y z, cell, minus high x y z, minus cell
};

/// Pairs in the order in which they were found.
struct CandidatePairs {
  std::vector<IndexPair> meeting;   ///< their boxes meet
  std::vector<IndexPair> doubtful;  ///< they meet in single precision
  std::size_t compared = 0;         ///< boxes compared to find them
};

/// An object and the cells of one level that its box touches.
struct CellRange {
  uint32_t object;  ///< caller's index, below CellTable::kMaxObjects
  int32_t level;
  std::array<int32_t, 3> low, high;  ///< cell coordinates, both inclusive
  CellBox box;                       ///< without a cell

  /// The same for a coarser level. Cells are halved from level to level, so those of all levels nest.
  CellRange at(int32_t coarser) const;
};

/// Objects are entered as the level's own, or as finer ones that belong to a level of smaller cells. A pair
/// is found here if at least one of the two is the level's own: this is the coarser of their levels.
///
/// Every pair is found once. The cells that two objects share are a box of cells. Its low corner is, along
/// each axis, the low cell of the one or of the other object, and it is the only shared cell of which that is
/// true. Each copy of an object remembers along which axes its cell is the object's low one: a pair counts
/// where the two copies together have all three axes. Other cells in the same bucket do not disturb: the cell
/// lanes are equal only for cells that are the same or a multiple of 256 apart, and no object spans more than
/// kMaxSpan.
class CellTable {
 public:
  static constexpr uint32_t kMaxObjects = 1u << 29;
  static constexpr int32_t kMaxSpan = 64;

  /// Enters objects, which are given from the finest level to this one, whose own begin at `first_own`;
  /// ranges are at their objects' levels. If `other`, the same level's table of other objects, is given
  /// (built or not), then finer objects are left out of buckets in which neither table has an own object:
  /// there is no partner for them.
  void build(int32_t level, std::span<const CellRange> objects, std::size_t first_own,
             const CellTable* other);
  /// Forgets the objects; keeps the memory.
  void clear();

  bool built() const { return !own_end_.empty(); }
  uint32_t bucket_count() const { return static_cast<uint32_t>(own_end_.size()); }
  /// In how many cells objects were entered.
  std::size_t copies() const { return copies_.size(); }

  /// Adds the pairs of the buckets [first, end).
  void find_pairs(uint32_t first, uint32_t end, CandidatePairs& out) const;
  /// Adds the pairs of what is in the buckets [first, end) with what is in the same level's table of other
  /// objects.
  void find_pairs_with(const CellTable& other, uint32_t first, uint32_t end, CandidatePairs& out) const;

 private:
  /// What is to be entered.
  struct Listed {
    uint32_t hash;
    uint32_t range;  // index
    float cell;
    uint32_t axes;
  };
  struct Copy {
    uint32_t hash;
    uint32_t object;  // index * 8 + the axes along which the cell is the object's low one
  };

  template <class Needed>
  void list(std::span<const CellRange> objects, std::size_t first, std::size_t end, Needed&& needed);
  void enter(std::span<const CellRange> objects, std::size_t own_copies);
  void compare(const CellBox& box, uint32_t object, uint32_t first, uint32_t end, CandidatePairs& out) const;
  bool has_own(uint32_t bucket) const { return own_end_[bucket] > begin_[bucket]; }

  int32_t level_ = 0;
  uint32_t mask_ = 0;                // of hashes, to buckets
  std::vector<uint32_t> begin_;      // of a bucket's copies; one more than there are buckets
  std::vector<uint32_t> own_end_;    // where a bucket's own objects end and the finer ones begin
  std::vector<uint32_t> finer_end_;  // where these end; needed while building
  std::vector<CellBox> boxes_;       // of the copies
  std::vector<Copy> copies_;
  std::vector<Listed> list_;  // needed while building
  std::size_t listed_ = 0;
};

}  // namespace offstage::sim
