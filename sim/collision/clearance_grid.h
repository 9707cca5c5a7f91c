#pragma once
/// A grid around a mesh. Each cell stores the distance to the mesh's surface, as a number of cells. One
/// look-up can prove that a small sphere does not touch the mesh. A search for the nearest triangle would
/// take hundreds of times as long.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

class ClearanceGrid {
 public:
  /// `solid`: whether the mesh has an inside. Points inside then do not count as clear.
  ClearanceGrid(const TriangleMesh& mesh, bool solid);

  /// Returns true only if a sphere (mesh frame) neither touches the surface nor is inside the mesh. The test
  /// is conservative: for a sphere within three cells of the surface the result may be false although the
  /// sphere is clear.
  bool is_clear(const Vec3& centre, Real radius) const;
  /// Returns true only if a point is not inside. It may return false for an outside point whose cell contains
  /// the surface.
  bool is_outside(const Vec3& p) const { return steps_[index(cell_of(p))] > 0; }
  /// Edge of a cell [m].
  Real cell() const { return cell_; }

 private:
  using Cell = std::array<int, 3>;
  Cell cell_of(const Vec3& p) const;
  std::size_t index(const Cell& c) const {
    return (static_cast<std::size_t>(c[2]) * static_cast<std::size_t>(count_[1]) +
            static_cast<std::size_t>(c[1])) *
               static_cast<std::size_t>(count_[0]) +
           static_cast<std::size_t>(c[0]);
  }
  void mark(const std::array<Vec3, 3>& triangle, std::vector<Cell>& surface);
  void flood_outside();
  void grow_rings(std::vector<Cell> ring);
  template <class F>
  void for_each_neighbor(const Cell& c, F&& f) const;

  Vec3 origin_;
  Real cell_ = 1;
  Cell count_{};
  /// 0 if the cell contains surface or is inside; otherwise the Chebyshev distance to the nearest cell that
  /// contains surface, in cells.
  std::vector<uint8_t> steps_;
};

}  // namespace offstage::sim
