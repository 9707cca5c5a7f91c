#pragma once
/// Generalised winding numbers: how often a surface goes around a point, which tells inside from outside even
/// where it has holes, doubled sheets or crossings. Jacobson, Kavan, Sorkine-Hornung, "Robust inside-outside
/// segmentation using generalized winding numbers" (2013); far clusters of triangles as dipoles after Barill
/// et al., "Fast winding numbers for soups and clouds" (2018).

#include <cstdint>
#include <span>
#include <vector>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

class WindingNumber {
 public:
  explicit WindingNumber(const TriangleMesh& mesh);

  /// 1 inside a closed surface, 0 outside, in between near holes; within 0.1 of the exact sum.
  Real at(const Vec3& p) const;

 private:
  /// Nodes lie in depth-first order; `next` is where a subtree ends.
  struct Node {
    Vec3 centre;       // of the area
    Vec3 area_normal;  // sum of areas times normals [m^2]
    Real radius;       // around the centre, of all triangles [m]
    uint32_t next = 0;
    uint32_t first = 0, count = 0;  // triangles of a leaf; a branch has none
  };
  using Corners = std::array<Vec3, 3>;

  void build(uint32_t first, uint32_t count);

  std::vector<Node> nodes_;
  std::vector<Corners> triangles_;  // in the order of the leaves
};

}  // namespace offstage::sim
