#pragma once
/// Loop's subdivision of triangle meshes (C. Loop, 1987; weights of J. Warren, 1995): every triangle becomes
/// four, and the surface becomes smoother. The weights depend only on the triangles and are computed once.
/// The positions of each frame are then weighted sums of the coarse positions.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace offstage::render {

/// Two vertices of a boundary edge, in the order of its triangle.
using BoundaryEdge = std::array<uint32_t, 2>;

/// Returns the edges that belong to exactly one triangle: the boundary of the mesh.
std::vector<BoundaryEdge> boundary_edges(std::span<const uint32_t> triangles);

/// One step of subdivision. Boundaries become cubic B-splines. A boundary vertex stays in place where the
/// boundary turns by more than 60 degrees, or where more than two boundary edges meet.
class LoopSubdivision {
 public:
  /// Prepares one step of subdivision. `triangles`: three indices each, below the size of `places`. `places`:
  /// positions of the vertices on the flat sheet. An edge of more than two triangles counts as boundary.
  LoopSubdivision(std::span<const uint32_t> triangles, std::span<const Eigen::Vector2f> places);

  /// Returns the triangles of the finer mesh. Its vertices are the coarse vertices, then one vertex per edge.
  const std::vector<uint32_t>& triangles() const { return triangles_; }
  std::size_t vertex_count() const { return first_term_.size() - 1; }

  /// Computes values at the vertices of the finer mesh from the values at the coarse vertices.
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
  std::vector<uint32_t> first_term_;  // first term of each vertex, then the end
  std::vector<Term> terms_;
};

}  // namespace offstage::render
