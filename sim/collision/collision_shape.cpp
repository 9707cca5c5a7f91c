#include "sim/collision/collision_shape.h"

#include <algorithm>

namespace offstage::sim {
namespace {

/// Returns the tree of a primitive: one volume around its box.
PieceTree tree_of(const Convex& hull, const Aabb& box, TreeVolume volume) {
  const Vec3 half = box.sizes() / 2;
  switch (volume) {
    case TreeVolume::obb:
      return ObbTree::of_one({box.center(), half, Mat3::Identity()});
    case TreeVolume::sphere:
      return SphereTree::of_one(half.norm() < hull.reach() ? BoundingSphere{box.center(), half.norm()}
                                                           : BoundingSphere{Vec3::Zero(), hull.reach()});
    case TreeVolume::aabb:
      break;
  }
  return AabbTree::of_one(box);
}

}  // namespace

CollisionShape::CollisionShape(const Solid& solid, const Options& options) : solid_(solid) {
  if (is_plane()) return;
  if (!solid.mesh) {
    hull_ = convex(*solid.shape);
    reach_ = hull_.reach();
    box_ = local_bounds(solid);
    own_tree_ = tree_of(hull_, box_, options.tree.volume);
    pieces_ = 1;
    return;
  }
  const CollisionMesh& mesh = *solid.mesh;
  hulls_ = mesh.hulls();
  hull_ = hulls_.size() == 1 ? hulls_.front() : convex(mesh.hull);
  reach_ = hull_.reach();
  for (const Convex& hull : hulls_) reach_ = std::max(reach_, hull.reach());
  using Method = ConvexDecomposition::Method;
  by_triangles_ = options.by_triangles;
  triangles_ = by_triangles_ || !mesh.solid || mesh.decomposition().method == Method::none ||
               (mesh.decomposition().method == Method::approximate && !options.needs_volume);
  if (options.tree == TreeChoice{})
    tree_ = triangles_ ? &mesh.tree : &mesh.part_tree();
  else
    std::visit([&](const auto& tree) { tree_ = &tree; }, mesh.piece_tree(triangles_, options.tree));
  box_ = triangles_ ? mesh.tree.bounds() : mesh.part_tree().bounds();
  pieces_ = static_cast<uint32_t>(with_tree([](const auto& tree) { return tree.items().size(); }));
}

uint32_t CollisionShape::first_piece(std::size_t k) const {
  return hulls_.size() > 1 ? solid_.mesh->first_part(k) : 0;
}

Convex CollisionShape::piece(uint32_t index) const {
  if (!solid_.mesh) return hull_;
  const CollisionMesh& mesh = *solid_.mesh;
  if (!triangles_) {
    const RoundSolid* round = mesh.round_part(index);
    return round ? convex(*round) : convex(mesh.decomposition().parts[index]);
  }
  const Triangle& t = mesh.mesh.triangles[index];
  return convex_triangle(mesh.mesh.vertices[t[0]], mesh.mesh.vertices[t[1]], mesh.mesh.vertices[t[2]]);
}

}  // namespace offstage::sim
