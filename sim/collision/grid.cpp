#include "sim/collision/grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {
namespace {

// Cell coordinates must be smaller than this, so objects far from the origin get larger cells.
constexpr Real kMaxCoordinate = 0x1p29;
// Greatest number of cells of an object along an axis. In the multi-level grid no object has nearly as many.
constexpr Real kMaxCells = CellTable::kMaxSpan;

}  // namespace

Real CellSizes::width(int32_t level) const {
  return kind == GridKind::uniform ? uniform_width : std::ldexp(1.0, kFinest + level);
}

int32_t CellSizes::level(const Aabb& box) const {
  const Vec3 sides = box.sizes();
  const Real reach = std::max(-box.min().minCoeff(), box.max().maxCoeff());
  if (!(reach < kMaxReach)) return kNone;
  if (kind == GridKind::uniform) {
    const bool few = (sides / uniform_width + Vec3::Ones()).prod() <= kMaxCells;
    return few && reach < kMaxCoordinate * uniform_width ? 0 : kNone;
  }
  // The width is the smallest power of two above all bounds.
  const Real bound = std::max(sides.maxCoeff() / (2 * kMinInCell), reach / kMaxCoordinate);
  return std::max(std::ilogb(std::max(bound, 0x1p-60)) + 1 - kFinest, 0);
}

CellRange CellSizes::range(uint32_t object, const Aabb& box, int32_t level) const {
  const Real per_metre = 1 / width(level);
  CellRange range{.object = object, .level = level};
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    range.low[i] = static_cast<int32_t>(std::floor(box.min()[k] * per_metre));
    range.high[i] = static_cast<int32_t>(std::floor(box.max()[k] * per_metre));
    range.box.bound[i] = static_cast<float>(box.min()[k]);
    range.box.bound[i + 4] = -static_cast<float>(box.max()[k]);
  }
  return range;
}

void Grid::assign(const CellSizes& sizes, std::span<const uint32_t> objects, std::span<const Aabb> boxes) {
  for (CellTable& table : tables_) table.clear();
  levels_.resize(objects.size());
  tbb::parallel_for(std::size_t{0}, objects.size(),
                    [&](std::size_t i) { levels_[i] = static_cast<int8_t>(sizes.level(boxes[objects[i]])); });

  begin_.fill(0);
  for (const int8_t level : levels_)
    if (level != CellSizes::kNone) ++begin_[static_cast<std::size_t>(level) + 1];
  std::inclusive_scan(begin_.begin(), begin_.end(), begin_.begin());
  ranges_.resize(begin_.back());
  large_.clear();
  auto next = begin_;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (levels_[i] == CellSizes::kNone) {
      large_.push_back(objects[i]);
      continue;
    }
    CellRange& range = ranges_[next[static_cast<std::size_t>(levels_[i])]++];
    range.object = objects[i];
    range.level = levels_[i];
  }
  tbb::parallel_for(std::size_t{0}, ranges_.size(), [&](std::size_t i) {
    ranges_[i] = sizes.range(ranges_[i].object, boxes[ranges_[i].object], ranges_[i].level);
  });
}

/// Builds the table of a level, which contains the objects of this level and of all finer levels.
void Grid::build(std::size_t level, const CellTable* other) {
  tables_[level].build(static_cast<int32_t>(level), std::span(ranges_).first(begin_[level + 1]),
                       begin_[level], other);
}

std::size_t Grid::copies() const {
  return std::transform_reduce(tables_.begin(), tables_.end(), std::size_t{0}, std::plus<>(),
                               [](const CellTable& table) { return table.copies(); });
}

// A table finds pairs with at least one object of its own level. So a grid needs the table of a level if it
// has objects of this level, or if it has finer objects and the other grid has objects of this level.

std::size_t Grid::enter_to_stay(const Grid& moving) {
  const std::size_t before = copies();
  tbb::parallel_for(std::size_t{0}, tables_.size(), [&](std::size_t level) {
    const bool finds = has_own(level) || (moving.has_own(level) && has_finer(level));
    if (finds && !tables_[level].built()) build(level, nullptr);
  });
  return copies() - before;
}

std::size_t Grid::enter_to_pair(const Grid& resting) {
  tbb::parallel_for(std::size_t{0}, tables_.size(), [&](std::size_t level) {
    if (has_own(level) || (resting.has_own(level) && has_finer(level))) build(level, &resting.tables_[level]);
  });
  return copies();
}

}  // namespace offstage::sim
