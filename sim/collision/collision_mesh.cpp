#include "sim/collision/collision_mesh.h"

#include <algorithm>
#include <list>
#include <utility>
#include <vector>

#include "sim/geometry/convex_hull.h"

namespace offstage::sim {
namespace {

/// The clear cells of the meshes that were asked for last, in any world of the process: a tuning session
/// builds the same world again for every change of a number, and filling the cells is most of that. What is
/// kept is a function of the mesh alone, so it makes no difference to results. At most 26 MB.
class RecentCells {
 public:
  ClearCells of(const TriangleMesh& mesh, bool solid) {
    {
      const std::lock_guard lock(mutex_);
      const auto known = std::ranges::find_if(entries_, [&](const Entry& e) {
        return e.solid == solid && e.mesh.vertices == mesh.vertices && e.mesh.triangles == mesh.triangles;
      });
      if (known != entries_.end()) {
        entries_.splice(entries_.begin(), entries_, known);
        return known->cells;
      }
    }
    ClearCells cells(mesh, solid);
    if (mesh.triangles.size() > kMostTriangles) return cells;
    const std::lock_guard lock(mutex_);
    entries_.push_front({mesh, solid, cells});
    if (entries_.size() > kMostEntries) entries_.pop_back();
    return cells;
  }

 private:
  static constexpr std::size_t kMostEntries = 16, kMostTriangles = 20'000;
  struct Entry {
    TriangleMesh mesh;
    bool solid;
    ClearCells cells;
  };
  std::mutex mutex_;
  std::list<Entry> entries_;  // latest first
};

ClearCells recent_cells(const TriangleMesh& mesh, bool solid) {
  static RecentCells cells;
  return cells.of(mesh, solid);
}

}  // namespace

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

const ClearCells& CollisionMesh::clear_cells() const {
  std::call_once(clear_once_, [this] { clear_cells_ = recent_cells(mesh, solid); });
  return *clear_cells_;
}

}  // namespace offstage::sim
