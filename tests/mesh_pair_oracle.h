#pragma once
/// Tests all pairs of triangles of two meshes by brute force, as a reference for the nine combinations of
/// kinds of trees.

#include <vector>

#include "sim/collision/volume_pair.h"
#include "tests/mesh_pair.h"
#include "tests/meshes.h"
#include "tests/random.h"

namespace offstage::sim {

/// Returns a sphere with random radii, without symmetry: 2 around (rings - 1) triangles.
inline TriangleMesh bumpy_sphere(uint32_t around, uint32_t rings, uint64_t seed) {
  TriangleMesh mesh = sphere_mesh(1, around, rings);
  for (uint64_t i = 0; i < mesh.vertices.size(); ++i)
    mesh.vertices[i] *= 0.8 + 0.4 * Scatter{seed}.uniform(i, 0);
  return mesh;
}

/// Returns a random rotation and a random translation of at most `reach` [m].
inline Pose random_pose(uint64_t i, Real reach) {
  const Scatter random{17};
  const auto value = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
  const Vec3 direction = Vec3(value(0), value(1), value(2)).normalized();
  return {reach * random.uniform(i, 3) * direction,
          Quat(value(4), value(5), value(6), value(7)).normalized()};
}

inline std::vector<TriangleVertices> triangles_of(const TriangleMesh& mesh, const Placement& place) {
  std::vector<TriangleVertices> triangles;
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.push_back(
        {place.point(mesh.vertices[a]), place.point(mesh.vertices[b]), place.point(mesh.vertices[c])});
  return triangles;
}

/// Calls visit(pair, triangle of a, triangle of b) for all pairs, in A's frame.
template <class Visit>
void for_each_brute_pair(const TriangleMesh& a, const TriangleMesh& b, const Pose& a_from_b, Visit&& visit) {
  const auto of_a = triangles_of(a, Placement(Pose(), 0, 0)),
             of_b = triangles_of(b, Placement(a_from_b, 0, 0));
  for (uint32_t i = 0; i < of_a.size(); ++i)
    for (uint32_t j = 0; j < of_b.size(); ++j) visit(TrianglePair{i, j}, of_a[i], of_b[j]);
}

/// Returns the intersecting pairs in ascending order. Pairs whose bounding boxes do not overlap are skipped.
inline std::vector<TrianglePair> brute_pairs(const TriangleMesh& a, const TriangleMesh& b,
                                             const Pose& a_from_b) {
  const auto of_a = triangles_of(a, Placement(Pose(), 0, 0)),
             of_b = triangles_of(b, Placement(a_from_b, 0, 0));
  const auto box = [](const TriangleVertices& t) {
    return Aabb(t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2]));
  };
  std::vector<Aabb> boxes;
  for (const TriangleVertices& t : of_b) boxes.push_back(box(t));
  std::vector<TrianglePair> pairs;
  for (uint32_t i = 0; i < of_a.size(); ++i)
    for (uint32_t j = 0; j < of_b.size(); ++j)
      if (boxes[j].intersects(box(of_a[i])) && triangles_intersect(of_a[i], of_b[j])) pairs.push_back({i, j});
  return pairs;
}

/// A mesh with a tree of each kind; both the book's split and the surface area heuristic are used.
struct AllTrees {
  explicit AllTrees(const TriangleMesh& m) : mesh(m), aabb(m), obb(m), sphere(m, TreeSplit::mean) {}

  const TriangleMesh& mesh;
  AabbTree aabb;
  ObbTree obb;
  SphereTree sphere;
};

/// Combines a mesh with one of its trees. This function exists because Clang 14 does not deduce the template
/// arguments of aggregates.
template <class Volume>
MeshTree<Volume> mesh_tree(const TriangleMesh& mesh, const BoundingTree<Volume>& tree) {
  return {mesh, tree};
}

/// Calls visit(a, b) for the nine combinations of tree kinds.
template <class Visit>
void for_each_kind(const AllTrees& a, const AllTrees& b, Visit&& visit) {
  const auto with_a = [&](const auto& tree_a) {
    const auto of_a = mesh_tree(a.mesh, tree_a);
    visit(of_a, mesh_tree(b.mesh, b.aabb));
    visit(of_a, mesh_tree(b.mesh, b.obb));
    visit(of_a, mesh_tree(b.mesh, b.sphere));
  };
  with_a(a.aabb);
  with_a(a.obb);
  with_a(a.sphere);
}

}  // namespace offstage::sim
