#pragma once
/// Signed distance to solids, with its gradient. A solid is a shape together with its registered mesh if it
/// has one; points and normals are in the shape's own frame. Distances to the primitives are exact, inside
/// and outside, and therefore convex functions of the point, which sphere_sweep.h relies on.

#include <limits>

#include "sim/collision/collision_mesh.h"
#include "sim/core/types.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

/// Distance of a point to a surface, negative inside, with its unit gradient at the point.
struct SurfaceDistance {
  Real distance = std::numeric_limits<Real>::infinity();
  Vec3 normal = Vec3::UnitY();
};

struct Solid {
  const Shape* shape = nullptr;
  const CollisionMesh* mesh = nullptr;  ///< the registered mesh of a MeshShape, otherwise null
};

SurfaceDistance signed_distance(const Sphere& s, const Vec3& p);
SurfaceDistance signed_distance(const Box& b, const Vec3& p);
SurfaceDistance signed_distance(const Capsule& c, const Vec3& p);
SurfaceDistance signed_distance(const Cylinder& c, const Vec3& p);
SurfaceDistance signed_distance(const Cone& c, const Vec3& p);
SurfaceDistance signed_distance(const Frustum& c, const Vec3& p);
SurfaceDistance signed_distance(const Ellipsoid& e, const Vec3& p);
SurfaceDistance signed_distance(const Plane&, const Vec3& p);
/// Signed distance to a mesh. It is positive on both sides of a mesh that is not solid; for a solid mesh, the
/// pseudonormal of the nearest feature determines whether the point is inside.
SurfaceDistance signed_distance(const CollisionMesh& m, const Vec3& p);
SurfaceDistance signed_distance(const Solid& s, const Vec3& p);
/// Returns the signed distance if it is less than `limit` [m], >= 0; otherwise some value that is at least
/// `limit`. Much faster than signed_distance() at points away from a mesh.
SurfaceDistance signed_distance_below(const Solid& s, const Vec3& p, Real limit);

/// Support function: the largest n.x over the points x of a solid; infinite for a plane unless n is +Y.
Real support(const Solid& s, const Vec3& n);

/// Tight box of a solid in its own frame; infinite for a plane.
Aabb local_bounds(const Solid& s);
/// Tight box of a placed solid in the world.
Aabb bounds(const Solid& s, const Pose& pose);
/// Distance of the solid's farthest point from the origin of its frame [m].
Real reach(const Solid& s);

}  // namespace offstage::sim
