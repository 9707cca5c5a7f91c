#pragma once
/// Pairs of triangles of two meshes that meet or are close (physics R3), tree against tree. Everything is
/// computed and answered in the frame of the first mesh, A; `a_from_b` places the second in it.

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

/// Triangles of A and of B by index.
struct TrianglePair {
  uint32_t a, b;
  friend auto operator<=>(const TrianglePair&, const TrianglePair&) = default;
};

/// Two triangles with their closest points. Where they intersect the points are one that they share.
struct CloseTriangles {
  TrianglePair triangles;
  ClosestPoints points;
};

/// Whether any two triangles intersect. A mesh wholly inside another does not.
template <class A, class B>
bool surfaces_intersect(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b);

/// All pairs of intersecting triangles, each once, appended to `pairs` in an order that depends on the trees.
/// They are just those for which triangles_intersect() holds after the rounding of B's vertices to A's frame.
template <class A, class B>
void intersecting_triangles(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b,
                            std::vector<TrianglePair>& pairs);

/// All pairs of triangles within `tolerance` of each other [m], appended to `pairs`.
template <class A, class B>
void close_triangles(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b, Real tolerance,
                     std::vector<CloseTriangles>& pairs);

/// The closest triangles of two meshes; none if one has no triangles or all are farther than `limit` [m].
/// `start` is where to look first: the last query's answer, or any pair. It decides how soon the answer is
/// found, not the distance.
template <class A, class B>
std::optional<CloseTriangles> closest_triangles(const MeshTree<A>& a, const MeshTree<B>& b,
                                                const Pose& a_from_b,
                                                std::optional<TrianglePair> start = std::nullopt,
                                                Real limit = std::numeric_limits<Real>::infinity());

}  // namespace offstage::sim
