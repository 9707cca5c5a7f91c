#pragma once
/// A registered mesh, with data that are computed once and then shared by all bodies with this mesh (physics
/// E2). All data are in the frame of the mesh.

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim/collision/bounding_tree.h"
#include "sim/collision/clearance_grid.h"
#include "sim/collision/convex.h"
#include "sim/collision/mesh_surface.h"
#include "sim/collision/piece_tree.h"
#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/mesh.h"
#include "sim/geometry/solid_mesh.h"

namespace offstage::sim {

class CollisionMesh {
 public:
  /// `known`: the decomposition of the mesh, if the caller has it. Otherwise it is computed when it is first
  /// needed.
  explicit CollisionMesh(TriangleMesh welded, std::optional<ConvexDecomposition> known = {});

  /// Creates a compound of at least one welded solid. Its mesh contains the meshes of all solids, which are
  /// not joined.
  explicit CollisionMesh(std::vector<SolidMesh> solids);

  TriangleMesh mesh;
  MeshTopology topology;
  MeshSurface surface;  ///< surroundings of each triangle
  MassProperties mass;
  AabbTree tree;          ///< tree of the triangles
  ConvexPolyhedron hull;  ///< convex hull of the vertices
  /// Whether the mesh is closed and not inverted, so that it has an inside; otherwise it is a two-sided
  /// surface.
  bool solid;
  /// The solids of a compound, if there are several. They may overlap, so faces of one can be inside another.
  std::vector<std::unique_ptr<const CollisionMesh>> solids;

  /// The convex decomposition. It is computed at the first call, which may take seconds. Several threads may
  /// call this.
  const ConvexDecomposition& decomposition() const;
  /// The exact solid that a part of the decomposition approximates; null if the part is exact.
  const RoundSolid* round_part(uint32_t part) const {
    return part < round_parts_.size() && round_parts_[part] ? &*round_parts_[part] : nullptr;
  }
  /// The convex hull of the exact solid of a compound to which a part belongs; null if it is not round.
  const RoundSolid* round_surface(uint32_t part) const;
  /// The exact convex hulls of the solids of a compound, if any of them is round; otherwise none.
  std::span<const Convex> hulls() const { return hulls_; }
  /// Index of the first part in hulls()[k].
  uint32_t first_part(std::size_t k) const { return exact_[k].first_part; }
  /// Index of the first part of the solid to which a part belongs, in a compound with hulls().
  uint32_t first_part_of_solid_of(uint32_t part) const { return exact_[solid_of(part)].first_part; }
  /// Bounding tree of the parts of the decomposition. Its items are the indices of the parts.
  const AabbTree& part_tree() const;
  /// Returns a bounding tree of the given kind, over the triangles or over the parts. It is computed at the
  /// first call for each kind. Several threads may call this.
  const PieceTree& piece_tree(bool of_triangles, const TreeChoice& choice) const;
  /// Returns the clearance grid around the mesh. It is computed at the first call, which takes about 10 ms.
  /// Several threads may call this.
  const ClearanceGrid& clearance_grid() const;

 private:
  void decompose_once() const;
  void set_round(std::vector<SolidMesh> list);
  std::size_t solid_of(uint32_t part) const;
  Aabb part_box(uint32_t part) const;

  // These are empty unless the mesh is a compound with round parts.
  struct Exact {
    uint32_t first_part;
    std::optional<RoundSolid> hull;  // nothing: the solid is not round
  };
  std::vector<Exact> exact_;                            // for each solid
  std::vector<std::optional<RoundSolid>> round_parts_;  // for each part
  std::vector<Convex> hulls_;                           // for each solid; they refer to exact_ and `solids`
  mutable std::once_flag once_;
  mutable std::optional<ConvexDecomposition> decomposition_;
  mutable AabbTree part_tree_;
  mutable std::mutex trees_mutex_;
  mutable std::map<std::pair<bool, TreeChoice>, PieceTree> trees_;
  mutable std::once_flag clear_once_;
  mutable std::optional<ClearanceGrid> clear_cells_;
};

}  // namespace offstage::sim
