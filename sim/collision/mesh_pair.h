#pragma once
/// Pairs of triangles of two meshes that intersect or are close (physics R3), by two trees. All results are
/// in the frame of the first mesh, A; `a_from_b` places the second one in it.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sim/collision/bounding_tree.h"
#include "sim/geometry/closest_points.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

/// A mesh and a tree of its triangles.
template <class Volume>
struct MeshTree {
  const TriangleMesh& mesh;
  const BoundingTree<Volume>& tree;
};

/// Indices of a triangle of A and of one of B.
struct TrianglePair {
  uint32_t a, b;
  friend auto operator<=>(const TrianglePair&, const TrianglePair&) = default;
};

/// Two triangles with their closest points. If they intersect, both points are a common point.
struct CloseTriangles {
  TrianglePair triangles;
  ClosestPoints points;
};

/// Whether any two triangles intersect. A mesh completely inside another does not.
template <class A, class B>
bool surfaces_intersect(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b);

/// Appends all pairs of intersecting triangles to `pairs`, each once, in an order that depends on the trees.
/// They are exactly those for which triangles_intersect() is true after the vertices of B are rounded to A's
/// frame.
template <class A, class B>
void intersecting_triangles(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b,
                            std::vector<TrianglePair>& pairs);

/// Appends all pairs of triangles within `tolerance` [m] of each other to `pairs`.
template <class A, class B>
void close_triangles(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b, Real tolerance,
                     std::vector<CloseTriangles>& pairs);

/// Returns the closest triangles of two meshes; none if one has no triangles or all are farther than `limit`
/// [m]. `start` is the pair to test first: the result of the last query, or any pair. It affects how soon the
/// result is found, not the distance.
template <class A, class B>
std::optional<CloseTriangles> closest_triangles(const MeshTree<A>& a, const MeshTree<B>& b,
                                                const Pose& a_from_b,
                                                std::optional<TrianglePair> start = std::nullopt,
                                                Real limit = std::numeric_limits<Real>::infinity());

}  // namespace offstage::sim
