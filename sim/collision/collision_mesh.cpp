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
  set_round(std::move(list));
}

/// Stores the exact solids of round parts.
void CollisionMesh::set_round(std::vector<SolidMesh> list) {
  if (std::ranges::none_of(list, [](const SolidMesh& s) { return s.round_hull.has_value(); })) return;
  for (SolidMesh& one : list) {
    exact_.push_back({static_cast<uint32_t>(round_parts_.size()), std::move(one.round_hull)});
    one.round_parts.resize(one.parts.size());
    round_parts_.insert(round_parts_.end(), one.round_parts.begin(), one.round_parts.end());
  }
  for (std::size_t k = 0; k < exact_.size(); ++k)
    hulls_.push_back(exact_[k].hull ? convex(*exact_[k].hull) : convex(solids[k]->hull));
}

const RoundSolid* CollisionMesh::round_surface(uint32_t part) const {
  if (exact_.empty()) return nullptr;
  const std::optional<RoundSolid>& exact = exact_[solid_of(part)].hull;
  return exact ? &*exact : nullptr;
}

/// Returns the index in hulls() of the solid to which a part belongs.
std::size_t CollisionMesh::solid_of(uint32_t part) const {
  const auto after = std::ranges::upper_bound(exact_, part, {}, &Exact::first_part);
  return static_cast<std::size_t>(after - exact_.begin()) - 1;
}

/// Returns the box of a part, which contains the exact solid, too.
Aabb CollisionMesh::part_box(uint32_t part) const {
  Aabb box = decomposition_->parts[part].box();
  const RoundSolid* round = round_part(part);
  if (!round) return box;
  const Convex exact = convex(*round);
  for (int axis = 0; axis < 3; ++axis)
    for (const Real side : {-1.0, 1.0}) {
      const Vec3 d = side * Vec3::Unit(axis);
      uint32_t start = 0;
      box.extend(exact.support(d, start) + exact.radius * d);
    }
  return box;
}

void CollisionMesh::decompose_once() const {
  std::call_once(once_, [this] {
    if (!decomposition_) decomposition_ = decompose(mesh, topology);
    std::vector<Aabb> boxes;
    for (uint32_t k = 0; k < decomposition_->parts.size(); ++k) boxes.push_back(part_box(k));
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
  std::vector<std::vector<Vec3>> corners;  // of the parts and of the boxes of round parts
  for (uint32_t k = 0; k < decomposition().parts.size(); ++k) {
    const std::span<const Vec3> vertices = decomposition().parts[k].vertices();
    corners.emplace_back(vertices.begin(), vertices.end());
    if (!round_part(k)) continue;
    const Aabb box = part_box(k);
    for (int i = 0; i < 8; ++i) corners.back().push_back(box.corner(static_cast<Aabb::CornerType>(i)));
  }
  const std::vector<std::span<const Vec3>> parts(corners.begin(), corners.end());
  return trees_.emplace(key, make_tree(std::span<const std::span<const Vec3>>(parts), choice)).first->second;
}

const ClearanceGrid& CollisionMesh::clearance_grid() const {
  std::call_once(clear_once_, [this] { clear_cells_ = recent_grid(mesh, solid); });
  return *clear_cells_;
}

}  // namespace offstage::sim
