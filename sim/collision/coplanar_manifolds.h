#pragma once
/// Joins the manifolds of one convex piece with the coplanar triangles of a mesh: the piece then lies on the
/// triangles as on one face, however they divide it.

#include <cstddef>
#include <vector>

#include "sim/collision/manifold.h"

namespace offstage::sim {

class CollisionMesh;

/// Joins manifolds from the index `from` on. `mesh_pose` is the pose of the mesh in their frame; `of_b`: the
/// mesh is B. A joined manifold has the place of its first one.
void join_coplanar(std::vector<Manifold>& manifolds, std::size_t from, const CollisionMesh& mesh,
                   const Pose& mesh_pose, bool of_b);

}  // namespace offstage::sim
