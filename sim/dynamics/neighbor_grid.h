#pragma once
/// Points sorted into cells, for finding those near a place (physics P2's cut-off, P3). The cells tile a
/// torus: along each axis they repeat after a power of two, so that a table of about as many cells as points
/// serves any extent, and what is far away, but in the same cell of the torus, is told apart by its distance.

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
  /// Sorts finite points into cells of width `cell` [m], > 0. The order depends on the arguments alone, not
  /// on threads; oneTBB's are used.
  void build(std::span<const Vec3> points, Real cell);

  /// Calls f(index) for every point within `radius` of p, the distance included; quickest for a radius up to
  /// the cells' width.
  template <class F>
  void for_each_near(const Vec3& p, Real radius, F&& f) const {
    if (index_.empty()) return;
    std::array<Run, 3> run;
    for (std::size_t k = 0; k < 3; ++k) run[k] = cells(p, radius, k);
    for (uint32_t i = 0; i < run[0].count; ++i)
      for (uint32_t j = 0; j < run[1].count; ++j)
        visit_cells(row(run[0].first + i, run[1].first + j), run[2], p, radius, f);
  }

  /// The same for the point at a place of the order, but of two points near each other only one is told of
  /// the other. The radius must not be greater than the cells' width.
  template <class F>
  void for_each_pair(std::size_t place, Real radius, F&& f) const {
    const Vec3 p = point(place);
    const std::array<Run, 3> run = {cells(p, radius, 0), cells(p, radius, 1), cells(p, radius, 2)};
    const std::array<uint32_t, 3> own = {cell_of(p, 0), cell_of(p, 1), cell_of(p, 2)};
    // How far the first cells are before the own one: one at most.
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

  /// The indices, sorted by cells.
  uint32_t at(std::size_t place) const { return index_[place]; }
  /// The cells of the torus lie in layers across its longest axis, an even number of them. Points nearer to
  /// each other than a cell's width are in the same or in neighbouring layers, of which the last and the
  /// first are two, too.
  uint32_t layers() const { return mask_[0] + 1; }
  /// Where in the order a layer begins; layers() gives its end.
  std::size_t layer_begin(uint32_t layer) const {
    return begin_[static_cast<std::size_t>(layer) << (bits_[1] + bits_[2])];
  }

 private:
  /// Cells in a row along an axis, each of the torus at most once.
  struct Run {
    uint32_t first, count;
  };

  /// Farther out all are in the same cell.
  static constexpr Real kMaxCell = 1e15;

  /// Points are looked at so many at once.
  static constexpr uint32_t kLanes = 4;

  Vec3 point(std::size_t place) const { return {x_[place], y_[place], z_[place]}; }
  /// The first cell of a row along the last axis.
  uint32_t row(uint32_t i, uint32_t j) const {
    return (((i & mask_[0]) << bits_[1]) + (j & mask_[1])) << bits_[2];
  }
  /// Calls f(index) for the points within the radius at the places from `from` up to but without `to`.
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
  /// The same in a run of cells of a row.
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
  std::array<Eigen::Index, 3> axis_{0, 1, 2};  // the longest first
  std::array<uint32_t, 3> bits_{}, mask_{};
  std::vector<uint32_t> begin_{0, 0};  // of each cell among the places, and the end
  std::vector<Real> x_, y_, z_;        // by place, with room for kLanes behind the last
  std::vector<uint32_t> index_;        // by place
  std::vector<uint32_t> bucket_, place_, counts_;
  std::vector<std::pair<uint32_t, uint32_t>> parted_;  // (bucket, index)
};

}  // namespace offstage::sim
