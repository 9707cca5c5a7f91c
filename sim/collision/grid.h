#pragma once
/// A set of boxes in the cells of a uniform or multi-level grid (physics H5, H6), with a CellTable for each
/// level.
///
/// An object of the multi-level grid with diameter d belongs to the level whose cells have a width L with
/// kMinInCell <= d/L < 2 kMinInCell. L is a power of two metres, where the book uses a power of two times
/// d_min/k_min. Therefore the level of an object and the cells of a level do not depend on the smallest
/// object. Levels exist only while they have objects, and a coarser cell follows from a finer one by a bit
/// shift. As in the book, objects are inserted at their own level and at every coarser level. Moving objects
/// are inserted only where they can find a partner. (Inserting each object only at its own level and looking
/// up coarser cells took a tenth longer if all objects move, and twice as long if many are at rest, because
/// contiguous data are compared fastest.) The uniform grid has a single level whose width is given.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/collision/cell_table.h"

namespace offstage::sim {

enum class GridKind {
  uniform,     ///< cells of CellSizes::kMeansInCell mean diameters
  multilevel,  ///< levels of cells, each twice as wide as the level below
};

/// Cell widths, and the level of a box. A box's diameter is its longest side.
struct CellSizes {
  /// Width of a cell of the uniform grid, as a multiple of the mean diameter (the book's k).
  static constexpr Real kMeansInCell = 2;
  /// Smallest diameter of a level's own objects, in cells of the multi-level grid (the book's k_min). Cells
  /// of two to four diameters were the fastest.
  static constexpr Real kMinInCell = 0.25;
  /// Levels have the numbers 0 to kLevels - 1. The cells of level 0 are 2^kFinest m wide, which is fine
  /// enough for objects of a micrometre.
  static constexpr int32_t kFinest = -18, kLevels = 64;
  /// Objects that reach farther than this from the origin are not inserted in cells [m].
  static constexpr Real kMaxReach = 0x1p40;
  /// This value replaces the level of objects that are too large or too far away for cells.
  static constexpr int32_t kNone = -1;

  GridKind kind = GridKind::multilevel;
  Real uniform_width = 1;  ///< [m]

  /// Width of a level's cells [m].
  Real width(int32_t level) const;
  /// The level that a box belongs to, or kNone.
  int32_t level(const Aabb& box) const;
  /// The cells that a box touches at its level.
  CellRange range(uint32_t object, const Aabb& box, int32_t level) const;
};

class Grid {
 public:
  /// Assigns the objects, given by their indices in `boxes`, to levels without inserting them in cells.
  void assign(const CellSizes& sizes, std::span<const uint32_t> objects, std::span<const Aabb> boxes);

  /// The objects that cells can hold, from the finest to the coarsest level.
  std::span<const CellRange> ranges() const { return ranges_; }
  /// The objects that are too large, or too far away, for the cells.
  std::span<const uint32_t> large() const { return large_; }

  /// For the grid of objects at rest: builds the complete tables that are needed for pairs with the objects
  /// of `moving`, unless they exist already. Returns the number of copies of objects in cells.
  std::size_t enter_to_stay(const Grid& moving);
  /// For the grid of moving objects: builds all tables that are needed for pairs among its own objects and
  /// for pairs with the objects of `resting`. Returns the number of copies of objects in cells.
  std::size_t enter_to_pair(const Grid& resting);

  /// Tables by level. Tables that cannot contain a pair are not built.
  const std::array<CellTable, CellSizes::kLevels>& tables() const { return tables_; }

 private:
  bool has_own(std::size_t level) const { return begin_[level] < begin_[level + 1]; }
  bool has_finer(std::size_t level) const { return begin_[level] > 0; }
  void build(std::size_t level, const CellTable* other);
  std::size_t copies() const;

  std::vector<CellRange> ranges_;
  std::array<uint32_t, CellSizes::kLevels + 1> begin_{};  // start of each level's own objects in ranges_
  std::vector<uint32_t> large_;
  std::array<CellTable, CellSizes::kLevels> tables_;
  std::vector<int8_t> levels_;  // levels of the assigned objects
};

}  // namespace offstage::sim
