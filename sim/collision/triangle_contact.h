#pragma once
/// Contact with triangles that are parts of a mesh: like manifold(), and then restricted to what the surface
/// around them allows (mesh_surface.h), on the side of it on which the other solid is.

#include <optional>
#include <vector>

#include "sim/collision/manifold.h"
#include "sim/collision/mesh_surface.h"

namespace offstage::sim {

/// The manifold of a sphere and a triangle in closed form, in the frame in which both are; `triangle` says on
/// which side of it the sphere is, however deep. No points if they are farther than `margin` [m] apart or the
/// surface around the triangle is nearer. `of_b`: the triangle is B.
void sphere_triangle_manifold(const Vec3& centre, Real radius, const SurfaceTriangle& triangle,
                              const Pose& mesh_pose, bool of_b, Real margin, Manifold& m);

/// The pieces of a pair that are triangles.
struct PairTriangles {
  std::optional<SurfaceTriangle> a, b;
};

/// The manifolds of two pieces, of which one or both are triangles, appended to `found`: see manifold().
/// Points at which the surface around a triangle does not allow the normal are left out, and in their place
/// comes what is over, or rather before, the triangle's face. `turning`: see find_manifolds().
void find_triangle_manifolds(const Convex& a, const Convex& b, const PairTriangles& triangles,
                             const Pose& a_from_b, const Separation& s, Real margin, bool turning,
                             std::vector<Manifold>& found);

}  // namespace offstage::sim
