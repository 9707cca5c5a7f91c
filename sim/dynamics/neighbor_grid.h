#pragma once
/// Points sorted into cells, for finding those near a place (physics P2's cut-off, P3). The cells tile a
/// torus: along each axis they repeat after a power of two, so that a table of about as many cells as points
/// serves any extent, and what is far away, but in the same cell of the torus, is told apart by its distance.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/types.h"

namespace offstage::sim {

class NeighborGrid {
 public:
  /// Sorts finite points into cells of width `cell` [m], > 0. The order depends on the arguments alone, not
  /// on threads; oneTBB's are used.
  void build(std::span<const Vec3> points, Real cell);

  /// Calls f(index) for every point within `radius` of p, the distance included; quickest for a radius up to
  /// the cells' width.
  template <class F>
  void for_each_near(const Vec3& p, Real radius, F&& f) const {
    if (entries_.empty()) return;
    std::array<Run, 3> run;
    for (std::size_t k = 0; k < 3; ++k) run[k] = cells(p, radius, k);
    const Real radius2 = radius * radius;
    const auto visit = [&](uint32_t from, uint32_t to) {
      for (uint32_t e = begin_[from]; e < begin_[to]; ++e)
        if ((entries_[e].point - p).squaredNorm() <= radius2) f(entries_[e].index);
    };
    for (uint32_t i = 0; i < run[0].count; ++i)
      for (uint32_t j = 0; j < run[1].count; ++j) {
        const uint32_t row = ((((run[0].first + i) & mask_[0]) << bits_[1]) + ((run[1].first + j) & mask_[1]))
                             << bits_[2];
        const uint32_t first = run[2].first & mask_[2], whole = mask_[2] + 1;
        visit(row + first, row + std::min(first + run[2].count, whole));
        if (first + run[2].count > whole) visit(row, row + first + run[2].count - whole);
      }
  }

  std::size_t size() const { return entries_.size(); }
  Real cell() const { return cell_; }

  /// The indices, sorted by cells.
  uint32_t at(std::size_t place) const { return entries_[place].index; }
  /// The cells of the torus lie in layers across its longest axis, an even number of them. Points nearer to
  /// each other than a cell's width are in the same or in neighbouring layers, of which the last and the
  /// first are two, too.
  uint32_t layers() const { return mask_[0] + 1; }
  /// Where in the order a layer begins; layers() gives its end.
  std::size_t layer_begin(uint32_t layer) const {
    return begin_[static_cast<std::size_t>(layer) << (bits_[1] + bits_[2])];
  }

 private:
  struct Entry {
    Vec3 point;
    uint32_t index;
  };
  /// Cells in a row along an axis, each of the torus at most once.
  struct Run {
    uint32_t first, count;
  };

  /// Farther out all are in the same cell.
  static constexpr Real kMaxCell = 1e15;

  int64_t coordinate(Real x) const {
    return static_cast<int64_t>(std::floor(std::clamp(x * inverse_, -kMaxCell, kMaxCell)));
  }
  Run cells(const Vec3& p, Real radius, std::size_t k) const {
    const Real x = p[axis_[k]];
    const int64_t low = coordinate(x - radius), high = coordinate(x + radius);
    return {static_cast<uint32_t>(low), static_cast<uint32_t>(std::min<int64_t>(high - low, mask_[k]) + 1)};
  }
  uint32_t bucket(const Vec3& p) const {
    std::array<uint32_t, 3> c;
    for (std::size_t k = 0; k < 3; ++k) c[k] = static_cast<uint32_t>(coordinate(p[axis_[k]])) & mask_[k];
    return (((c[0] << bits_[1]) + c[1]) << bits_[2]) + c[2];
  }
  void choose_torus(std::span<const Vec3> points);

  Real cell_ = 1, inverse_ = 1;
  std::array<Eigen::Index, 3> axis_{0, 1, 2};  // the longest first
  std::array<uint32_t, 3> bits_{}, mask_{};
  std::vector<uint32_t> begin_{0, 0};  // of each cell in entries_, and the end
  std::vector<Entry> entries_;
  std::vector<uint32_t> bucket_, place_, counts_;
  std::vector<std::pair<uint32_t, uint32_t>> parted_;  // (bucket, index)
};

}  // namespace offstage::sim
