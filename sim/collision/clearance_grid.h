#pragma once
/// How far the space around a mesh is clear of it, in cells: one look-up tells that a small sphere touches
/// nothing, where a search for the nearest triangle would take hundreds of times as long.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

class ClearanceGrid {
 public:
  /// `solid`: the mesh has an inside, which is not clear.
  ClearanceGrid(const TriangleMesh& mesh, bool solid);

  /// Whether a sphere (mesh frame) surely neither touches the surface nor is inside of it; may be false for
  /// one that does not, too, if that is within three cells of the surface.
  bool is_clear(const Vec3& centre, Real radius) const;
  /// Whether a point is surely not inside; may be false for one that is not, if the surface is in its cell.
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
  /// 0: the surface is in the cell, or the cell is inside; else how many cells away the nearest of the
  /// surface is, as a king walks on a chessboard.
  std::vector<uint8_t> steps_;
};

}  // namespace offstage::sim
