#pragma once
/// Loop's subdivision of triangle meshes (C. Loop, 1987; weights of J. Warren, 1995): every triangle becomes
/// four, and the surface smoother. What depends on the triangles alone is worked out once; positions that
/// change every frame are then weighted sums of the coarse ones.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace offstage::render {

/// Two vertices that one triangle alone joins, in the order of that triangle.
using BoundaryEdge = std::array<uint32_t, 2>;

/// Edges of one triangle only: the mesh's rim.
std::vector<BoundaryEdge> boundary_edges(std::span<const uint32_t> triangles);

/// One step of subdivision. Boundaries become cubic B-splines; where a boundary turns by more than 60 degrees
/// is a corner, which stays, as does a vertex where more than two boundaries meet.
class LoopSubdivision {
 public:
  /// `triangles`: three indices each, below the number of `places`, which are where the vertices lie along
  /// the flat sheet. An edge of more than two triangles counts as boundary.
  LoopSubdivision(std::span<const uint32_t> triangles, std::span<const Eigen::Vector2f> places);

  /// Of the finer mesh: the coarse vertices come first, then one for each edge.
  const std::vector<uint32_t>& triangles() const { return triangles_; }
  std::size_t vertex_count() const { return first_term_.size() - 1; }

  /// Values at the finer mesh's vertices from those at the coarse one's.
  template <class V>
  void refine(std::span<const V> coarse, std::vector<V>& fine) const {
    fine.resize(vertex_count());
    for (std::size_t v = 0; v < fine.size(); ++v) {
      V sum = V::Zero();
      for (uint32_t k = first_term_[v]; k < first_term_[v + 1]; ++k)
        sum += terms_[k].weight * coarse[terms_[k].vertex];
      fine[v] = sum;
    }
  }

 private:
  struct Term {
    uint32_t vertex;
    float weight;
  };
  std::vector<uint32_t> triangles_;
  std::vector<uint32_t> first_term_;  // of each vertex, and the end
  std::vector<Term> terms_;
};

}  // namespace offstage::render
