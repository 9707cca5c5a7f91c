#pragma once
/// Generalized winding numbers: how often a surface winds around a point. They distinguish inside from
/// outside even where the surface has holes, doubled sheets or self-intersections (Jacobson, Kavan,
/// Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", 2013). Far
/// clusters of triangles are approximated by dipoles (Barill et al., "Fast winding numbers for soups and
/// clouds", 2018).

#include <cstdint>
#include <span>
#include <vector>

#include "sim/geometry/mesh.h"

namespace offstage::sim {

class WindingNumber {
 public:
  explicit WindingNumber(const TriangleMesh& mesh);

  /// Returns the winding number at p with an error of at most 0.1: 1 inside a closed surface, 0 outside, and
  /// values in between near holes.
  Real at(const Vec3& p) const;

 private:
  /// Nodes lie in depth-first order; `next` is where a subtree ends.
  struct Node {
    Vec3 centre;       // area centroid
    Vec3 area_normal;  // sum of areas times normals [m^2]
    Real radius;       // radius around the centre that encloses all triangles [m]
    uint32_t next = 0;
    uint32_t first = 0, count = 0;  // range of triangles of a leaf; count is 0 for a branch
  };
  using Corners = std::array<Vec3, 3>;

  void build(uint32_t first, uint32_t count);

  std::vector<Node> nodes_;
  std::vector<Corners> triangles_;  // in the order of the leaves
};

}  // namespace offstage::sim
