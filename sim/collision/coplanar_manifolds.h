#pragma once
/// Joins the manifolds between one convex piece and coplanar triangles of a mesh. The contact is then the
/// same as on a single face, independently of the triangulation.

#include <cstddef>
#include <vector>

#include "sim/collision/manifold.h"

namespace offstage::sim {

class CollisionMesh;

/// Joins the manifolds of the list from index `from` on. `mesh_pose`: pose of the mesh in the frame of the
/// manifolds. `of_b`: whether the mesh is B. A joined manifold takes the place of the first of its parts; the
/// others are removed.
void join_coplanar(std::vector<Manifold>& manifolds, std::size_t from, const CollisionMesh& mesh,
                   const Pose& mesh_pose, bool of_b);

}  // namespace offstage::sim
