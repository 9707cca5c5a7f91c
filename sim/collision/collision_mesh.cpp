#include "sim/collision/collision_mesh.h"

#include <utility>
#include <vector>

#include "sim/geometry/convex_hull.h"

namespace offstage::sim {

CollisionMesh::CollisionMesh(TriangleMesh welded, std::optional<ConvexDecomposition> known)
    : mesh(std::move(welded)),
      topology(mesh),
      surface(mesh, topology),
      mass(mass_properties(mesh)),
      tree(mesh),
      hull(convex_hull(mesh.vertices)),
      solid(topology.defects().closed() && !topology.defects().inverted),
      decomposition_(std::move(known)) {}

void CollisionMesh::decompose_once() const {
  std::call_once(once_, [this] {
    if (!decomposition_) decomposition_ = decompose(mesh, topology);
    std::vector<Aabb> boxes;
    for (const ConvexPolyhedron& part : decomposition_->parts) boxes.push_back(part.box());
    part_tree_ = AabbTree(boxes);
  });
}

const ConvexDecomposition& CollisionMesh::decomposition() const {
  decompose_once();
  return *decomposition_;
}

const AabbTree& CollisionMesh::part_tree() const {
  decompose_once();
  return part_tree_;
}

const ClearanceGrid& CollisionMesh::clearance_grid() const {
  std::call_once(clear_once_, [this] { clear_cells_.emplace(mesh, solid); });
  return *clear_cells_;
}

}  // namespace offstage::sim
