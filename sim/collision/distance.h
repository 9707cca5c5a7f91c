#pragma once
/// Signed distance of points to solids, with its gradient. A solid is a shape, together with the registered
/// mesh for a MeshShape. Points and normals are in the frame of the shape. Distances to primitives are exact
/// inside and outside. They are therefore convex functions of the point; sphere_sweep.h relies on this.

#include <limits>

#include "sim/collision/collision_mesh.h"
#include "sim/core/types.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

/// Distance of a point to a surface [m], negative inside, and the unit gradient of the distance at the point.
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
/// Returns the signed distance to a mesh. For a mesh that is not solid it is positive on both sides. For a
/// solid mesh, the pseudonormal of the nearest feature determines whether the point is inside.
SurfaceDistance signed_distance(const CollisionMesh& m, const Vec3& p);
SurfaceDistance signed_distance(const Solid& s, const Vec3& p);
/// Returns the signed distance if it is less than `limit` [m], >= 0; otherwise some value that is at least
/// `limit`. It is much faster than signed_distance() at points away from a mesh.
SurfaceDistance signed_distance_below(const Solid& s, const Vec3& p, Real limit);

/// Returns the support function: the largest n.x of all points x of a solid [m]. For a plane it is infinite
/// unless n is +Y.
Real support(const Solid& s, const Vec3& n);

/// Returns the smallest box around a solid, in the solid's frame. The box of a plane is infinite.
Aabb local_bounds(const Solid& s);
/// Returns the smallest box around a solid at a pose, in world coordinates.
Aabb bounds(const Solid& s, const Pose& pose);
/// Returns the greatest distance of the solid's points from the origin of its frame [m].
Real reach(const Solid& s);

}  // namespace offstage::sim
