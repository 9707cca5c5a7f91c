#pragma once
/// A body's shape as the narrow phase sees it: convex pieces, and a tree over their boxes. A primitive is one
/// piece. A mesh is represented by the parts of its convex decomposition, or by its triangles if it has no
/// inside or if its decomposition is only approximate and the body does not need one (see CollisionShape's
/// constructor). The half-space under a plane has no pieces.

#include <optional>

#include "sim/collision/collision_mesh.h"
#include "sim/collision/convex.h"
#include "sim/collision/distance.h"

namespace offstage::sim {

class CollisionShape {
 public:
  /// `solid` and the data it points to must outlive the shape. Dynamic bodies set `needs_volume`: contacts
  /// with them need a penetration depth, so a mesh is represented by its parts even if these are approximate.
  /// For other bodies the exact surface is preferred.
  CollisionShape(const Solid& solid, bool needs_volume);

  const Solid& solid() const { return solid_; }
  bool is_plane() const { return std::holds_alternative<Plane>(*solid_.shape); }

  uint32_t piece_count() const { return static_cast<uint32_t>(tree().items().size()); }
  Convex piece(uint32_t index) const;
  /// Its items are the indices of the pieces.
  const AabbTree& tree() const { return mesh_tree_ ? *mesh_tree_ : own_tree_; }
  /// Whether the pieces are triangles that bound a solid. An object can then be inside it without touching a
  /// piece.
  bool is_hollow() const { return triangles_ && solid_.mesh->solid; }
  /// The mesh whose triangles are the pieces; null if the pieces are not triangles.
  const CollisionMesh* surface() const { return triangles_ ? solid_.mesh : nullptr; }
  /// The convex hull of all pieces. Not available for a plane.
  const Convex& hull() const { return hull_; }

 private:
  Solid solid_;
  Convex hull_;
  AabbTree own_tree_;                    // tree of a primitive: one box
  const AabbTree* mesh_tree_ = nullptr;  // tree of the parts or triangles
  bool triangles_ = false;
};

}  // namespace offstage::sim
