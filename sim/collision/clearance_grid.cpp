#include "sim/collision/clearance_grid.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

constexpr Real kCells = 96;  // number of cells along the longest side
constexpr int kPadding = 3;  // cells around the mesh; rounding may use up one of them
constexpr uint8_t kUnknown = 255, kOutside = 254;
constexpr Real kClearRounding = 1e-9;  // bound of rounding errors, as a fraction of a cell

Aabb bounds(const TriangleMesh& mesh) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  return box;
}

}  // namespace

ClearanceGrid::ClearanceGrid(const TriangleMesh& mesh, bool solid) {
  const Aabb box = bounds(mesh);
  const Real longest = box.isEmpty() ? 0 : box.sizes().maxCoeff();
  cell_ = longest > 0 ? longest / kCells : 1;
  origin_ = (box.isEmpty() ? Vec3(Vec3::Zero()) : box.min()) - Vec3::Constant(kPadding * cell_);
  for (std::size_t k = 0; k < 3; ++k) {
    const Real size = box.isEmpty() ? 0 : box.sizes()[static_cast<Eigen::Index>(k)];
    count_[k] = static_cast<int>(std::ceil(size / cell_)) + 1 + 2 * kPadding;
  }
  steps_.assign(index({0, 0, count_[2]}), kUnknown);

  std::vector<Cell> surface;
  for (const Triangle& t : mesh.triangles)
    mark({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, surface);
  if (solid)
    flood_outside();
  else
    std::replace(steps_.begin(), steps_.end(), kUnknown, kOutside);
  std::replace(steps_.begin(), steps_.end(), kUnknown, uint8_t{0});
  grow_rings(std::move(surface));
}

ClearanceGrid::Cell ClearanceGrid::cell_of(const Vec3& p) const {
  Cell c;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    c[k] = static_cast<int>(std::clamp(std::floor((p[axis] - origin_[axis]) / cell_), 0.0, count_[k] - 1.0));
  }
  return c;
}

bool ClearanceGrid::is_clear(const Vec3& centre, Real radius) const {
  // A point outside of the grid is farther from everything in the grid than the nearest cell of the grid.
  const int steps = steps_[index(cell_of(centre))];
  return (steps - 1) * cell_ > radius;
}

/// Marks the cells that a triangle may intersect. The triangle is halved repeatedly, until its pieces are as
/// small as cells.
void ClearanceGrid::mark(const std::array<Vec3, 3>& triangle, std::vector<Cell>& surface) {
  std::vector<std::array<Vec3, 3>> pieces = {triangle};
  while (!pieces.empty()) {
    const std::array<Vec3, 3> t = pieces.back();
    pieces.pop_back();
    std::size_t longest = 0;  // the edge that follows this corner
    Real length = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Real l = (t[(k + 1) % 3] - t[k]).squaredNorm();
      if (l > length) length = l, longest = k;
    }
    if (length > cell_ * cell_) {
      const Vec3 a = t[longest], b = t[(longest + 1) % 3], c = t[(longest + 2) % 3], middle = (a + b) / 2;
      pieces.push_back({a, middle, c});
      pieces.push_back({middle, b, c});
      continue;
    }
    const Vec3 margin = Vec3::Constant(kClearRounding * cell_);
    const Cell low = cell_of(t[0].cwiseMin(t[1]).cwiseMin(t[2]) - margin),
               high = cell_of(t[0].cwiseMax(t[1]).cwiseMax(t[2]) + margin);
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x) {
          uint8_t& steps = steps_[index({x, y, z})];
          if (steps == 0) continue;
          steps = 0;
          surface.push_back({x, y, z});
        }
  }
}

template <class F>
void ClearanceGrid::for_each_neighbor(const Cell& c, F&& f) const {
  for (int z = std::max(c[2] - 1, 0); z <= std::min(c[2] + 1, count_[2] - 1); ++z)
    for (int y = std::max(c[1] - 1, 0); y <= std::min(c[1] + 1, count_[1] - 1); ++y)
      for (int x = std::max(c[0] - 1, 0); x <= std::min(c[0] + 1, count_[0] - 1); ++x) f(Cell{x, y, z});
}

/// Marks the cells outside of the mesh by a flood fill from a corner of the grid. The marked surface is
/// closed, so the fill does not enter the inside.
void ClearanceGrid::flood_outside() {
  std::vector<Cell> open = {{0, 0, 0}};
  steps_[0] = kOutside;
  while (!open.empty()) {
    const Cell c = open.back();
    open.pop_back();
    for_each_neighbor(c, [&](const Cell& n) {
      uint8_t& steps = steps_[index(n)];
      if (steps != kUnknown) return;
      steps = kOutside;
      open.push_back(n);
    });
  }
}

void ClearanceGrid::grow_rings(std::vector<Cell> ring) {
  std::vector<Cell> next;
  for (uint8_t steps = 1; steps < kOutside && !ring.empty(); ++steps) {
    next.clear();
    for (const Cell& c : ring) {
      for_each_neighbor(c, [&](const Cell& n) {
        uint8_t& s = steps_[index(n)];
        if (s != kOutside) return;
        s = steps;
        next.push_back(n);
      });
    }
    ring.swap(next);
  }
}

}  // namespace offstage::sim
