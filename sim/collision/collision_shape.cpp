#include "sim/collision/collision_shape.h"

#include <array>

namespace offstage::sim {

CollisionShape::CollisionShape(const Solid& solid, bool needs_volume) : solid_(solid) {
  if (is_plane()) return;
  if (!solid.mesh) {
    hull_ = convex(*solid.shape);
    own_tree_ = AabbTree(std::array{local_bounds(solid)});
    return;
  }
  const CollisionMesh& mesh = *solid.mesh;
  hull_ = convex(mesh.hull);
  using Method = ConvexDecomposition::Method;
  triangles_ = !mesh.solid || mesh.decomposition().method == Method::none ||
               (mesh.decomposition().method == Method::approximate && !needs_volume);
  mesh_tree_ = triangles_ ? &mesh.tree : &mesh.part_tree();
}

Convex CollisionShape::piece(uint32_t index) const {
  if (!mesh_tree_) return hull_;
  const CollisionMesh& mesh = *solid_.mesh;
  if (!triangles_) return convex(mesh.decomposition().parts[index]);
  const Triangle& t = mesh.mesh.triangles[index];
  return convex_triangle(mesh.mesh.vertices[t[0]], mesh.mesh.vertices[t[1]], mesh.mesh.vertices[t[2]]);
}

}  // namespace offstage::sim
