#pragma once
/// Finds pairs of triangles of two meshes that intersect or are close. It uses the same traversal of two
/// trees as the narrow phase (sim/collision/tree_pair.h). All results are in the frame of the first mesh, A;
/// `a_from_b` is the pose of the second mesh, B, in this frame.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sim/collision/bounding_tree.h"
#include "sim/collision/tree_pair.h"
#include "sim/geometry/closest_points.h"
#include "sim/geometry/intersection.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

/// A mesh and a tree of its triangles.
template <class Volume>
struct MeshTree {
  const TriangleMesh& mesh;
  const BoundingTree<Volume>& tree;
};

/// Indices of a triangle of A and a triangle of B.
struct TrianglePair {
  uint32_t a, b;
  friend auto operator<=>(const TrianglePair&, const TrianglePair&) = default;
};

/// Two triangles and their closest points. If the triangles intersect, both points are the same common point.
struct CloseTriangles {
  TrianglePair triangles;
  ClosestPoints points;
};

/// The vertices of the triangles of both meshes in A's frame. The traversal visits a triangle of B with many
/// triangles of A in succession, so the last triangle of B is kept.
class PlacedTriangles {
 public:
  PlacedTriangles(const TriangleMesh& a, const TriangleMesh& b, const Placement& placement)
      : a_(a), b_(b), placement_(placement) {}

  TriangleVertices of_a(uint32_t i) const {
    const Triangle& t = a_.triangles[i];
    return {a_.vertices[t[0]], a_.vertices[t[1]], a_.vertices[t[2]]};
  }
  const TriangleVertices& of_b(uint32_t i) {
    if (i != last_) {
      for (std::size_t k = 0; k < 3; ++k)
        last_vertices_[k] = placement_.point(b_.vertices[b_.triangles[i][k]]);
      last_ = i;
    }
    return last_vertices_;
  }

 private:
  const TriangleMesh &a_, &b_;
  const Placement& placement_;
  uint32_t last_ = kNoFace;
  TriangleVertices last_vertices_;
};

template <class A, class B>
Placement mesh_placement(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b, Real margin = 0) {
  return Placement(a_from_b, std::max(a.tree.reach(), b.tree.reach()), margin);
}

/// Returns whether any triangle of A intersects a triangle of B. The result is false if one mesh is
/// completely inside the other.
template <class A, class B>
bool surfaces_intersect(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b) {
  const Placement place = mesh_placement(a, b, a_from_b);
  PlacedTriangles triangles(a.mesh, b.mesh, place);
  return !for_each_pair(a.tree, b.tree, place, [&](uint32_t i, uint32_t j) {
    return !triangles_intersect(triangles.of_a(i), triangles.of_b(j));
  });
}

/// Appends all pairs of intersecting triangles to `pairs`, each once, in an order that depends on the trees.
/// The result is exact: it contains the pairs for which triangles_intersect() is true after the vertices of B
/// were transformed to A's frame, with rounding.
template <class A, class B>
void intersecting_triangles(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b,
                            std::vector<TrianglePair>& pairs) {
  const Placement place = mesh_placement(a, b, a_from_b);
  PlacedTriangles triangles(a.mesh, b.mesh, place);
  for_each_pair(a.tree, b.tree, place, [&](uint32_t i, uint32_t j) {
    if (triangles_intersect(triangles.of_a(i), triangles.of_b(j))) pairs.push_back({i, j});
  });
}

/// Appends all pairs of triangles within `tolerance` [m] of each other to `pairs`.
template <class A, class B>
void close_triangles(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b, Real tolerance,
                     std::vector<CloseTriangles>& pairs) {
  const Placement place = mesh_placement(a, b, a_from_b, tolerance);
  PlacedTriangles triangles(a.mesh, b.mesh, place);
  for_each_pair(a.tree, b.tree, place, [&](uint32_t i, uint32_t j) {
    const ClosestPoints points = closest_on_triangles(triangles.of_a(i), triangles.of_b(j));
    if (points.squared_distance <= tolerance * tolerance) pairs.push_back({{i, j}, points});
  });
}

/// Returns the closest triangles of two meshes; none if one has no triangles or all are farther than `limit`
/// [m]. `start` is the pair to test first: the result of the last query, or any pair. It affects how soon the
/// result is found, not the distance.
template <class A, class B>
std::optional<CloseTriangles> closest_triangles(const MeshTree<A>& a, const MeshTree<B>& b,
                                                const Pose& a_from_b,
                                                std::optional<TrianglePair> start = std::nullopt,
                                                Real limit = std::numeric_limits<Real>::infinity()) {
  const Placement place = mesh_placement(a, b, a_from_b);
  PlacedTriangles triangles(a.mesh, b.mesh, place);
  std::optional<CloseTriangles> best;
  const auto distance = [&](uint32_t i, uint32_t j) {
    const ClosestPoints points = closest_on_triangles(triangles.of_a(i), triangles.of_b(j));
    const Real d = std::sqrt(points.squared_distance);
    if (d <= limit && (!best || points.squared_distance < best->points.squared_distance))
      best = {{i, j}, points};
    return d;
  };
  Real nearest = limit;
  if (start && start->a < a.mesh.triangles.size() && start->b < b.mesh.triangles.size())
    nearest = std::min(nearest, distance(start->a, start->b));
  nearest_pair(a.tree, b.tree, place, nearest, distance);
  return best;
}

}  // namespace offstage::sim
