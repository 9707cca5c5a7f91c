#pragma once
/// Contact with triangles that are parts of a mesh: manifolds as manifold() returns them, but restricted to
/// the normals that the surrounding surface allows (mesh_surface.h), on the side on which the other solid is.

#include <optional>
#include <vector>

#include "sim/collision/manifold.h"
#include "sim/collision/mesh_surface.h"

namespace offstage::sim {

/// Computes the manifold of a sphere and a triangle in closed form, in their common frame;
/// SurfaceTriangle::side is the side from which the sphere came, even if the sphere is now deep behind the
/// triangle. The manifold has no points if both are more than `margin` [m] apart, or if a neighbouring
/// triangle is nearer. `of_b`: whether the triangle is B.
void sphere_triangle_manifold(const Vec3& centre, Real radius, const SurfaceTriangle& triangle,
                              const Pose& mesh_pose, bool of_b, Real margin, Manifold& m);

/// The triangles of a pair of pieces; empty where the piece is a convex part.
struct PairTriangles {
  std::optional<SurfaceTriangle> a, b;
};

/// Appends the manifolds of two pieces, at least one of them a triangle, to `found`; see manifold(). Points
/// at which the surface around a triangle does not allow the normal are replaced by points in front of the
/// triangle's face. `turning`: whether a body turns by a large angle in the sub-step; see find_manifolds().
void find_triangle_manifolds(const Convex& a, const Convex& b, const PairTriangles& triangles,
                             const Pose& a_from_b, const Separation& s, Real margin, bool turning,
                             std::vector<Manifold>& found);

}  // namespace offstage::sim
