#include "sim/collision/mesh_pair.h"

#include <algorithm>
#include <cmath>

#include "sim/collision/tree_pair.h"

namespace offstage::sim {
namespace {

/// The vertices of the triangles of both meshes in A's frame. The traversal visits a triangle of B with many
/// of A in a row, so the last one is kept.
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

}  // namespace

template <class A, class B>
bool surfaces_intersect(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b) {
  const Placement place = mesh_placement(a, b, a_from_b);
  PlacedTriangles triangles(a.mesh, b.mesh, place);
  return !for_each_pair(a.tree, b.tree, place, [&](uint32_t i, uint32_t j) {
    return !triangles_intersect(triangles.of_a(i), triangles.of_b(j));
  });
}

template <class A, class B>
void intersecting_triangles(const MeshTree<A>& a, const MeshTree<B>& b, const Pose& a_from_b,
                            std::vector<TrianglePair>& pairs) {
  const Placement place = mesh_placement(a, b, a_from_b);
  PlacedTriangles triangles(a.mesh, b.mesh, place);
  for_each_pair(a.tree, b.tree, place, [&](uint32_t i, uint32_t j) {
    if (triangles_intersect(triangles.of_a(i), triangles.of_b(j))) pairs.push_back({i, j});
  });
}

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

template <class A, class B>
std::optional<CloseTriangles> closest_triangles(const MeshTree<A>& a, const MeshTree<B>& b,
                                                const Pose& a_from_b, std::optional<TrianglePair> start,
                                                Real limit) {
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

#define OFFSTAGE_MESH_PAIR(A, B)                                                                   \
  template bool surfaces_intersect(const MeshTree<A>&, const MeshTree<B>&, const Pose&);           \
  template void intersecting_triangles(const MeshTree<A>&, const MeshTree<B>&, const Pose&,        \
                                       std::vector<TrianglePair>&);                                \
  template void close_triangles(const MeshTree<A>&, const MeshTree<B>&, const Pose&, Real,         \
                                std::vector<CloseTriangles>&);                                     \
  template std::optional<CloseTriangles> closest_triangles(const MeshTree<A>&, const MeshTree<B>&, \
                                                           const Pose&, std::optional<TrianglePair>, Real);
OFFSTAGE_MESH_PAIR(Aabb, Aabb)
OFFSTAGE_MESH_PAIR(Aabb, Obb)
OFFSTAGE_MESH_PAIR(Aabb, BoundingSphere)
OFFSTAGE_MESH_PAIR(Obb, Aabb)
OFFSTAGE_MESH_PAIR(Obb, Obb)
OFFSTAGE_MESH_PAIR(Obb, BoundingSphere)
OFFSTAGE_MESH_PAIR(BoundingSphere, Aabb)
OFFSTAGE_MESH_PAIR(BoundingSphere, Obb)
OFFSTAGE_MESH_PAIR(BoundingSphere, BoundingSphere)
#undef OFFSTAGE_MESH_PAIR

}  // namespace offstage::sim
