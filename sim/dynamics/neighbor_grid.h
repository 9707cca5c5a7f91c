#pragma once
/// Points sorted into grid cells, to search for neighbours (physics P2, P3). The cells tile a torus: along
/// each axis, cell indices repeat with a period that is a power of two. Therefore a table with about as many
/// cells as points is sufficient for any extent. Distant points in the same cell of the torus are excluded by
/// their distance.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

class NeighborGrid {
 public:
  /// Sorts finite points into cells of width `cell` [m], > 0, on oneTBB's threads. The order depends only on
  /// the arguments, not on threads.
  void build(std::span<const Vec3> points, Real cell);

  /// Calls f(index) for every point within `radius` of p, inclusive. It is fastest for a radius of at most
  /// the width of a cell.
  template <class F>
  void for_each_near(const Vec3& p, Real radius, F&& f) const {
    if (index_.empty()) return;
    std::array<Run, 3> run;
    for (std::size_t k = 0; k < 3; ++k) run[k] = cells(p, radius, k);
    for (uint32_t i = 0; i < run[0].count; ++i)
      for (uint32_t j = 0; j < run[1].count; ++j)
        visit_cells(row(run[0].first + i, run[1].first + j), run[2], p, radius, f);
  }

  /// Calls f(index) for neighbours of the point at position `place` in the sorted order. Over all places,
  /// each pair of points within `radius` is reported only once. The radius must not be greater than the width
  /// of a cell.
  template <class F>
  void for_each_pair(std::size_t place, Real radius, F&& f) const {
    const Vec3 p = point(place);
    const std::array<Run, 3> run = {cells(p, radius, 0), cells(p, radius, 1), cells(p, radius, 2)};
    const std::array<uint32_t, 3> own = {cell_of(p, 0), cell_of(p, 1), cell_of(p, 2)};
    // Distance of the own cell from the first cells: at most one.
    const std::array<uint32_t, 3> before = {own[0] - run[0].first, own[1] - run[1].first,
                                            own[2] - run[2].first};
    const uint32_t cell = row(own[0], own[1]) + (own[2] & mask_[2]);
    visit(static_cast<uint32_t>(place) + 1, begin_[cell + 1], p, radius, f);
    visit_cells(row(own[0], own[1]), {own[2] + 1, run[2].count - before[2] - 1}, p, radius, f);
    for (uint32_t j = before[1] + 1; j < run[1].count; ++j)
      visit_cells(row(own[0], run[1].first + j), run[2], p, radius, f);
    for (uint32_t i = before[0] + 1; i < run[0].count; ++i)
      for (uint32_t j = 0; j < run[1].count; ++j)
        visit_cells(row(run[0].first + i, run[1].first + j), run[2], p, radius, f);
  }

  std::size_t size() const { return index_.size(); }
  Real cell() const { return cell_; }

  /// Index of the point at a place of the sorted order.
  uint32_t at(std::size_t place) const { return index_[place]; }
  /// The cells of the torus form layers across its longest axis; their number is even. Points closer than the
  /// width of a cell are in the same layer or in neighbouring layers. The last and the first layer are
  /// neighbours, too.
  uint32_t layers() const { return mask_[0] + 1; }
  /// First place of a layer in the sorted order; layer_begin(layers()) is the end.
  std::size_t layer_begin(uint32_t layer) const {
    return begin_[static_cast<std::size_t>(layer) << (bits_[1] + bits_[2])];
  }

 private:
  /// Consecutive cells along an axis; each cell of the torus occurs at most once.
  struct Run {
    uint32_t first, count;
  };

  /// Points beyond this cell are all in the same cell.
  static constexpr Real kMaxCell = 1e15;

  /// Number of points that are tested at once.
  static constexpr uint32_t kLanes = 4;

  Vec3 point(std::size_t place) const { return {x_[place], y_[place], z_[place]}; }
  /// First cell of a row along the last axis.
  uint32_t row(uint32_t i, uint32_t j) const {
    return (((i & mask_[0]) << bits_[1]) + (j & mask_[1])) << bits_[2];
  }
  /// Calls f(index) for the points within the radius at the places [from, to).
  template <class F>
  void visit(uint32_t from, uint32_t to, const Vec3& p, Real radius, F&& f) const {
    const Real radius2 = radius * radius;
    for (uint32_t e = from; e < to; e += kLanes) {
      std::array<Real, kLanes> distance2;
      for (uint32_t k = 0; k < kLanes; ++k) {
        const Real x = x_[e + k] - p.x(), y = y_[e + k] - p.y(), z = z_[e + k] - p.z();
        distance2[k] = x * x + y * y + z * z;
      }
      for (uint32_t k = 0; k < std::min(kLanes, to - e); ++k)
        if (distance2[k] <= radius2) f(index_[e + k]);
    }
  }
  /// Calls f(index) for the points within the radius in consecutive cells of a row.
  template <class F>
  void visit_cells(uint32_t row, Run run, const Vec3& p, Real radius, F&& f) const {
    const uint32_t first = run.first & mask_[2], whole = mask_[2] + 1;
    visit(begin_[row + first], begin_[row + std::min(first + run.count, whole)], p, radius, f);
    if (first + run.count > whole) visit(begin_[row], begin_[row + first + run.count - whole], p, radius, f);
  }

  int64_t coordinate(Real x) const {
    return static_cast<int64_t>(std::floor(std::clamp(x * inverse_, -kMaxCell, kMaxCell)));
  }
  Run cells(const Vec3& p, Real radius, std::size_t k) const {
    const Real x = p[axis_[k]];
    const int64_t low = coordinate(x - radius), high = coordinate(x + radius);
    return {static_cast<uint32_t>(low), static_cast<uint32_t>(std::min<int64_t>(high - low, mask_[k]) + 1)};
  }
  uint32_t cell_of(const Vec3& p, std::size_t k) const {
    return static_cast<uint32_t>(coordinate(p[axis_[k]]));
  }
  uint32_t bucket(const Vec3& p) const {
    return row(cell_of(p, 0), cell_of(p, 1)) + (cell_of(p, 2) & mask_[2]);
  }
  void choose_torus(std::span<const Vec3> points);

  Real cell_ = 1, inverse_ = 1;
  std::array<Eigen::Index, 3> axis_{0, 1, 2};  // the longest axis first
  std::array<uint32_t, 3> bits_{}, mask_{};
  std::vector<uint32_t> begin_{0, 0};  // first place of each cell, and the end
  std::vector<Real> x_, y_, z_;        // by place, with kLanes more elements after the last
  std::vector<uint32_t> index_;        // by place
  std::vector<uint32_t> bucket_, place_, counts_;
  std::vector<std::pair<uint32_t, uint32_t>> parted_;  // (bucket, index)
};

}  // namespace offstage::sim
