#include "sim/collision/collision_mesh.h"

#include <algorithm>
#include <list>
#include <utility>
#include <vector>

#include "sim/geometry/convex_hull.h"

namespace offstage::sim {
namespace {

/// Keeps the clearance grids of the latest meshes for all worlds of the process, in at most 26 MB. The tuning
/// page builds a world after every change, and would spend most of that time on the same grids. A grid
/// depends only on its mesh, so keeping it does not change results.
class RecentGrids {
 public:
  ClearanceGrid of(const TriangleMesh& mesh, bool solid) {
    {
      const std::lock_guard lock(mutex_);
      const auto known = std::ranges::find_if(entries_, [&](const Entry& e) {
        return e.solid == solid && e.mesh.vertices == mesh.vertices && e.mesh.triangles == mesh.triangles;
      });
      if (known != entries_.end()) {
        entries_.splice(entries_.begin(), entries_, known);
        return known->grid;
      }
    }
    ClearanceGrid grid(mesh, solid);
    if (mesh.triangles.size() > kMostTriangles) return grid;
    const std::lock_guard lock(mutex_);
    entries_.push_front({mesh, solid, grid});
    if (entries_.size() > kMostEntries) entries_.pop_back();
    return grid;
  }

 private:
  static constexpr std::size_t kMostEntries = 16, kMostTriangles = 20'000;
  struct Entry {
    TriangleMesh mesh;
    bool solid;
    ClearanceGrid grid;
  };
  std::mutex mutex_;
  std::list<Entry> entries_;  // latest first
};

ClearanceGrid recent_grid(const TriangleMesh& mesh, bool solid) {
  static RecentGrids grids;
  return grids.of(mesh, solid);
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

namespace {

TriangleMesh joined(const std::vector<SolidMesh>& solids) {
  TriangleMesh all;
  for (const SolidMesh& solid : solids) {
    const auto first = static_cast<uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), solid.mesh.vertices.begin(), solid.mesh.vertices.end());
    for (const Triangle& t : solid.mesh.triangles)
      all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return all;
}

ConvexDecomposition all_parts(const std::vector<SolidMesh>& solids) {
  ConvexDecomposition all{.method = ConvexDecomposition::Method::exact, .parts = {}, .note = {}};
  for (const SolidMesh& solid : solids)
    all.parts.insert(all.parts.end(), solid.parts.begin(), solid.parts.end());
  return all;
}

}  // namespace

CollisionMesh::CollisionMesh(std::vector<SolidMesh> list) : CollisionMesh(joined(list), all_parts(list)) {
  if (list.size() > 1)
    for (const SolidMesh& one : list) solids.push_back(std::make_unique<CollisionMesh>(std::vector{one}));
}

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

const PieceTree& CollisionMesh::piece_tree(bool of_triangles, const TreeChoice& choice) const {
  const std::lock_guard lock(trees_mutex_);
  const std::pair key(of_triangles, choice);
  if (const auto known = trees_.find(key); known != trees_.end()) return known->second;
  if (of_triangles) return trees_.emplace(key, make_tree(mesh, choice)).first->second;
  std::vector<std::span<const Vec3>> parts;
  for (const ConvexPolyhedron& part : decomposition().parts) parts.push_back(part.vertices());
  return trees_.emplace(key, make_tree(std::span<const std::span<const Vec3>>(parts), choice)).first->second;
}

const ClearanceGrid& CollisionMesh::clearance_grid() const {
  std::call_once(clear_once_, [this] { clear_cells_ = recent_grid(mesh, solid); });
  return *clear_cells_;
}

}  // namespace offstage::sim
