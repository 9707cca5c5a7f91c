#pragma once
/// One level of a broad-phase grid: equal cubic cells in a hash table (physics H5, H6). The objects of a
/// bucket are stored contiguously with copies of their boxes, so that a bucket is read sequentially; empty
/// space takes no memory. A table is built as a whole by counting sort, which is faster than updating cells
/// one by one if more than a few objects move.

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

/// A box as eight numbers, for a fast overlap test: A overlaps B if and only if low(A) <= high(B) and
/// -high(A) <= -low(B), which is one comparison of eight lanes. Rounding to single precision preserves order.
/// Therefore boxes that overlap in double precision also overlap here; if no two compared lanes are equal,
/// the converse is true as well. The fourth axis contains the number of the cell, so copies in different
/// cells do not overlap.
struct alignas(32) CellBox {
  std::array<float, 8> bound;  ///< low x y z, cell, minus high x y z, minus cell
};

/// Pairs in the order in which they were found.
struct CandidatePairs {
  std::vector<IndexPair> meeting;  ///< pairs whose boxes overlap
  /// Pairs whose boxes overlap in single precision; the caller must test them in double precision.
  std::vector<IndexPair> doubtful;
  std::size_t compared = 0;  ///< number of boxes compared
};

/// An object and the cells of one level that its box touches.
struct CellRange {
  uint32_t object;  ///< caller's index, below CellTable::kMaxObjects
  int32_t level;
  std::array<int32_t, 3> low, high;  ///< cell coordinates, both inclusive
  CellBox box;                       ///< box of the object; the lanes of its cell are not set

  /// Returns the cells of the same object at a coarser level. The cell width doubles from level to level, so
  /// each cell lies within one cell of the next level.
  CellRange at(int32_t coarser) const;
};

/// A table contains the objects of its own level, and finer objects, which belong to levels of smaller cells.
/// It finds the pairs of which at least one object belongs to its own level. Each pair is thus found at the
/// coarser of the two levels.
///
/// Every pair is found only once. The cells that two objects share form a box of cells. The low corner of
/// this box is the only shared cell that, along each axis, is the lowest cell of at least one of the two
/// objects. Each copy of an object stores along which axes its cell is the object's lowest one. A pair counts
/// in the cell where the two copies together have all three axes. Other cells in the same bucket cause no
/// false pairs: the cell lanes are equal only for cells that are the same or a multiple of 256 apart, and no
/// object spans more than kMaxSpan.
class CellTable {
 public:
  static constexpr uint32_t kMaxObjects = 1u << 29;
  static constexpr int32_t kMaxSpan = 64;

  /// Inserts objects, ordered from the finest level to this one; the level's own objects begin at
  /// `first_own`. Each range is at the level of its object. `other`, if not null, is the table of the same
  /// level in the other grid, built or not. Finer objects are then omitted from buckets in which neither
  /// table has an object of this level, because they have no partner there.
  void build(int32_t level, std::span<const CellRange> objects, std::size_t first_own,
             const CellTable* other);
  /// Removes all objects; keeps the memory.
  void clear();

  bool built() const { return !own_end_.empty(); }
  uint32_t bucket_count() const { return static_cast<uint32_t>(own_end_.size()); }
  /// Number of copies of objects in cells.
  std::size_t copies() const { return copies_.size(); }

  /// Adds the pairs of the buckets [first, end).
  void find_pairs(uint32_t first, uint32_t end, CandidatePairs& out) const;
  /// Adds the pairs of an object in the buckets [first, end) and an object of another table of the same
  /// level.
  void find_pairs_with(const CellTable& other, uint32_t first, uint32_t end, CandidatePairs& out) const;

 private:
  /// A copy of an object for one cell that its box touches, before it is inserted. `hash` is the hash of the
  /// cell.
  struct Listed {
    uint32_t hash;
    uint32_t range;  // index of the range
    float cell;
    uint32_t axes;
  };
  struct Copy {
    uint32_t hash;
    uint32_t object;  // 8 * index + bits of the axes along which the cell is the object's low cell
  };

  template <class Needed>
  void list(std::span<const CellRange> objects, std::size_t first, std::size_t end, Needed&& needed);
  void enter(std::span<const CellRange> objects, std::size_t own_copies);
  void compare(const CellBox& box, uint32_t object, uint32_t first, uint32_t end, CandidatePairs& out) const;
  bool has_own(uint32_t bucket) const { return own_end_[bucket] > begin_[bucket]; }

  int32_t level_ = 0;
  uint32_t mask_ = 0;                // maps hashes to buckets
  std::vector<uint32_t> begin_;      // first copy of each bucket; one more entry than there are buckets
  std::vector<uint32_t> own_end_;    // end of a bucket's own objects, where the finer ones begin
  std::vector<uint32_t> finer_end_;  // end of the finer objects; needed while building
  std::vector<CellBox> boxes_;       // boxes of the copies
  std::vector<Copy> copies_;
  std::vector<Listed> list_;  // needed while building
  std::size_t listed_ = 0;
};

}  // namespace offstage::sim
