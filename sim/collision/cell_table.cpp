#include "sim/collision/cell_table.h"

#include <algorithm>
#include <bit>
#include <utility>

#include <experimental/simd>

namespace offstage::sim {
namespace {

namespace stdx = std::experimental;
using Half = stdx::simd<float, stdx::simd_abi::deduce_t<float, 4>>;
using CellLanes = stdx::simd<float, stdx::simd_abi::deduce_t<float, 8>>;

constexpr uint32_t kAllAxes = 7;
constexpr std::size_t kMinBuckets = 1024;

CellLanes lanes(const CellBox& box) {
  return CellLanes(box.bound.data(), stdx::vector_aligned);
}

/// Returns limits for the lanes of other boxes: boxes that overlap this one exceed none of them.
CellLanes limits(const CellBox& box) {
  const Half low(box.bound.data(), stdx::vector_aligned),
      minus_high(box.bound.data() + 4, stdx::vector_aligned);
  return stdx::concat(-minus_high, -low);
}

/// Returns the hash of a cell. Cells that are neighbours along x are neighbours in the table.
uint32_t hash(int32_t x, int32_t y, int32_t z) {
  return static_cast<uint32_t>(x) + static_cast<uint32_t>(y) * 0x9e3779b1u +
         static_cast<uint32_t>(z) * 0x85ebca6bu;
}

/// Returns a number that is equal for equal cells, for comparison in a lane: 24 bits, exact in single
/// precision.
float cell_lane(int32_t x, int32_t y, int32_t z) {
  return static_cast<float>((x & 255) << 16 | (y & 255) << 8 | (z & 255));
}

CellBox in_cell(CellBox box, float cell) {
  box.bound[3] = cell;
  box.bound[7] = -cell;
  return box;
}

/// Calls visit(hash, cell lane, axes along which this is the object's low cell) for the cells of a range, in
/// blocks of 2 x 2 x 2. Nearly every object has one or two cells along each axis, and the processor cannot
/// predict which. Therefore one loop over the cells of a block is faster than three nested loops.
template <class Visit>
void for_each_cell(const CellRange& range, Visit&& visit) {
  const auto& [x0, y0, z0] = range.low;
  const auto& [x1, y1, z1] = range.high;
  for (int32_t z = z0; z <= z1; z += 2)
    for (int32_t y = y0; y <= y1; y += 2)
      for (int32_t x = x0; x <= x1; x += 2) {
        const uint32_t within = 1u * (x < x1) | 2u * (y < y1) | 4u * (z < z1);
        const uint32_t lowest = 1u * (x == x0) | 2u * (y == y0) | 4u * (z == z0);
        uint32_t c = 0;
        do {
          const int32_t cx = x + static_cast<int32_t>(c & 1), cy = y + static_cast<int32_t>(c >> 1 & 1),
                        cz = z + static_cast<int32_t>(c >> 2);
          visit(hash(cx, cy, cz), cell_lane(cx, cy, cz), lowest & ~c);
          c = (c - within) & within;  // next subset of the axes
        } while (c != 0);
      }
}

}  // namespace

CellRange CellRange::at(int32_t coarser) const {
  CellRange range = *this;
  const int32_t shift = std::min(coarser - level, 31);
  for (std::size_t k = 0; k < 3; ++k) {
    range.low[k] >>= shift;
    range.high[k] >>= shift;
  }
  range.level = coarser;
  return range;
}

void CellTable::clear() {
  own_end_.clear();
  copies_.clear();
}

/// Appends the copies of objects [first, end) for which needed(hash) is true to the list.
template <class Needed>
void CellTable::list(std::span<const CellRange> objects, std::size_t first, std::size_t end,
                     Needed&& needed) {
  constexpr std::size_t kMaxCells = 8 * kMaxSpan;
  for (std::size_t i = first; i < end; ++i) {
    if (list_.size() < listed_ + kMaxCells) list_.resize(2 * listed_ + kMaxCells);
    for_each_cell(objects[i].at(level_), [&](uint32_t hash, float cell, uint32_t axes) {
      list_[listed_] = {hash, static_cast<uint32_t>(i), cell, axes};
      listed_ += needed(hash);
    });
  }
}

void CellTable::build(int32_t level, std::span<const CellRange> objects, std::size_t first_own,
                      const CellTable* other) {
  const std::size_t buckets = std::bit_ceil(kMinBuckets + 4 * (objects.size() - first_own) + first_own / 2);
  level_ = level;
  mask_ = static_cast<uint32_t>(buckets - 1);
  begin_.resize(buckets + 1);
  own_end_.assign(buckets, 0);
  finer_end_.assign(buckets, 0);

  listed_ = 0;
  list(objects, first_own, objects.size(), [](uint32_t) { return true; });
  const std::size_t own_copies = listed_;
  for (std::size_t i = 0; i < own_copies; ++i) ++own_end_[list_[i].hash & mask_];
  list(objects, 0, first_own, [&](uint32_t hash) {
    return !other || own_end_[hash & mask_] > 0 || (other->built() && other->has_own(hash & other->mask_));
  });
  for (std::size_t i = own_copies; i < listed_; ++i) ++finer_end_[list_[i].hash & mask_];

  uint32_t sum = 0;
  for (std::size_t b = 0; b < buckets; ++b) {
    begin_[b] = sum;
    sum += std::exchange(own_end_[b], sum);
    sum += std::exchange(finer_end_[b], sum);
  }
  begin_[buckets] = sum;
  enter(objects, own_copies);
}

/// Moves the list into the buckets.
void CellTable::enter(std::span<const CellRange> objects, std::size_t own_copies) {
  boxes_.resize(listed_);
  copies_.resize(listed_);
  for (std::size_t i = 0; i < listed_; ++i) {
    const Listed& l = list_[i];
    const uint32_t at = (i < own_copies ? own_end_ : finer_end_)[l.hash & mask_]++;
    boxes_[at] = in_cell(objects[l.range].box, l.cell);
    copies_[at] = {l.hash, objects[l.range].object << 3 | l.axes};
  }
}

/// Compares a copy with the copies [first, end). Every index is written, and only the matching ones are
/// counted; this avoids a branch that cannot be predicted.
void CellTable::compare(const CellBox& box, uint32_t object, uint32_t first, uint32_t end,
                        CandidatePairs& out) const {
  constexpr uint32_t kBlock = 128;
  constexpr int kCellLanes = 2;
  const CellLanes limit = limits(box);
  out.compared += end - first;
  std::array<uint32_t, kBlock> hits;
  for (; first < end; first += kBlock) {
    const uint32_t last = std::min(first + kBlock, end);
    std::size_t count = 0;
    for (uint32_t k = first; k < last; ++k) {
      hits[count] = k;
      count += stdx::all_of(lanes(boxes_[k]) <= limit);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const uint32_t other = copies_[hits[i]].object;
      if (((object | other) & kAllAxes) != kAllAxes) continue;
      const bool certain = stdx::popcount(lanes(boxes_[hits[i]]) == limit) == kCellLanes;
      (certain ? out.meeting : out.doubtful)
          .push_back({std::min(object, other) >> 3, std::max(object, other) >> 3});
    }
  }
}

void CellTable::find_pairs(uint32_t first, uint32_t end, CandidatePairs& out) const {
  for (uint32_t b = first; b < end; ++b)
    for (uint32_t i = begin_[b]; i < own_end_[b]; ++i)
      compare(boxes_[i], copies_[i].object, i + 1, begin_[b + 1], out);
}

void CellTable::find_pairs_with(const CellTable& other, uint32_t first, uint32_t end,
                                CandidatePairs& out) const {
  for (uint32_t b = first; b < end; ++b)
    for (uint32_t i = begin_[b]; i < begin_[b + 1]; ++i) {
      const uint32_t bucket = copies_[i].hash & other.mask_;
      const uint32_t last = i < own_end_[b] ? other.begin_[bucket + 1] : other.own_end_[bucket];
      other.compare(boxes_[i], copies_[i].object, other.begin_[bucket], last, out);
    }
}

}  // namespace offstage::sim
