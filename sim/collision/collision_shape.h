#pragma once
/// A body's shape for the narrow phase: convex pieces, and a bounding tree over them. A primitive is one
/// piece. A mesh is represented by the parts of its convex decomposition or by its triangles. Triangles are
/// used if the mesh has no inside, or if its decomposition is only approximate and the body does not need one
/// (see CollisionShape's constructor). The half-space under a plane has no pieces.

#include <optional>
#include <span>
#include <variant>

#include "sim/collision/collision_mesh.h"
#include "sim/collision/convex.h"
#include "sim/collision/distance.h"

namespace offstage::sim {

class CollisionShape {
 public:
  struct Options {
    /// Whether contacts need a penetration depth, as the contacts of dynamic bodies do. A mesh is then
    /// represented by its convex parts, even if these are approximate. Otherwise its exact surface is
    /// preferred.
    bool needs_volume = false;
    /// Whether a mesh is represented by its triangles in any case. Two shapes with this option are tested
    /// triangle against triangle.
    bool by_triangles = false;
    TreeChoice tree = {};
  };
  /// `solid` and the data it points to must outlive the shape.
  CollisionShape(const Solid& solid, const Options& options);
  CollisionShape(const Solid& solid, bool needs_volume)
      : CollisionShape(solid, Options{.needs_volume = needs_volume}) {}

  const Solid& solid() const { return solid_; }
  bool is_plane() const { return std::holds_alternative<Plane>(*solid_.shape); }

  uint32_t piece_count() const { return pieces_; }
  Convex piece(uint32_t index) const;
  /// Calls f(tree) with the tree of the pieces and returns the result. The tree's items are the indices of
  /// the pieces. The shape must not be a plane, because a plane has no pieces.
  template <class F>
  decltype(auto) with_tree(F&& f) const {
    switch (tree_.index()) {
      case 1:
        return f(*std::get<1>(tree_));
      case 2:
        return f(*std::get<2>(tree_));
      case 3:
        return f(*std::get<3>(tree_));
      default:
        break;
    }
    if (const auto* tree = std::get_if<ObbTree>(&own_tree_)) return f(*tree);
    if (const auto* tree = std::get_if<SphereTree>(&own_tree_)) return f(*tree);
    return f(std::get<AabbTree>(own_tree_));
  }
  /// Box of all pieces.
  const Aabb& box() const { return box_; }
  /// Whether the pieces are triangles that bound a solid. An object can then be inside it without touching a
  /// piece.
  bool is_hollow() const { return triangles_ && solid_.mesh->solid; }
  /// The mesh whose triangles are the pieces; null if the pieces are not triangles.
  const CollisionMesh* surface() const { return triangles_ ? solid_.mesh : nullptr; }
  /// Whether Options::by_triangles was chosen for a mesh.
  bool is_by_triangles() const { return by_triangles_; }
  /// Returns the convex hull of all pieces. A plane has none. For a compound with round parts it is the hull
  /// of the polyhedra that approximate them.
  const Convex& hull() const { return hull_; }
  /// Returns exact convex hulls that together contain all pieces: one, or for a compound with round parts one
  /// for each part.
  std::span<const Convex> hulls() const { return hulls_.empty() ? std::span(&hull_, 1) : hulls_; }
  /// Index of the first piece in hulls()[k].
  uint32_t first_piece(std::size_t k) const;
  /// Greatest distance of the shape's points from the origin of its frame [m], or a little more.
  Real reach() const { return reach_; }

 private:
  Solid solid_;
  Convex hull_;
  std::span<const Convex> hulls_;
  Real reach_ = 0;
  PieceTree own_tree_;  // tree of a primitive: one volume
  // The tree of a mesh's parts or triangles.
  std::variant<std::monostate, const AabbTree*, const ObbTree*, const SphereTree*> tree_;
  Aabb box_;
  uint32_t pieces_ = 0;
  bool triangles_ = false, by_triangles_ = false;
};

/// Calls f(tree of a, tree of b) and returns the result. The two trees may be of different kinds.
template <class F>
decltype(auto) with_trees(const CollisionShape& a, const CollisionShape& b, F&& f) {
  return a.with_tree(
      [&](const auto& tree_a) { return b.with_tree([&](const auto& tree_b) { return f(tree_a, tree_b); }); });
}

}  // namespace offstage::sim
