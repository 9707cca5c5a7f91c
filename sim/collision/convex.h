#pragma once
/// A convex solid as GJK, the penetration test and the advancement see it: the support mapping of a core, and
/// a radius around the core. A sphere is a point with a radius, a capsule a segment with one; so the smooth
/// shapes have exact distances.

#include <array>
#include <cstdint>

#include "sim/core/types.h"
#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

struct Convex {
  enum class Core : uint8_t { point, segment, triangle, box, cylinder, cone, polyhedron };

  Core core = Core::point;
  /// Of the core: box half sizes; (radius, half height, -) of cylinder and cone; half height in y of a
  /// segment.
  Vec3 half = Vec3::Zero();
  Real radius = 0;  ///< around the core [m]
  const ConvexPolyhedron* polyhedron = nullptr;
  std::array<const Vec3*, 3> corners{};  ///< of a triangle

  /// The farthest point of the core along `d`, which need not be unit. For a polyhedron `vertex` says where
  /// to start climbing and, afterwards, which vertex it is; for a box likewise, by the bits of its signs; for
  /// a segment which end, for a triangle which corner. Other cores leave it alone.
  Vec3 support(const Vec3& d, uint32_t& vertex) const;
  /// Whether support points are vertices, which a number brings back.
  bool has_vertices() const { return core != Core::cylinder && core != Core::cone; }
  /// The vertex of the core with this number, as support() gives it; a number that is none stands for
  /// another.
  Vec3 vertex(uint32_t number) const;
  /// A point inside the core.
  Vec3 centre() const;
  /// Distance of the farthest point, radius included, from the frame's origin [m].
  Real reach() const;
};

/// The convex solid of a primitive; MeshShape and Plane have none and are not accepted.
Convex convex(const Shape& primitive);
Convex convex(const ConvexPolyhedron& polyhedron, Real radius = 0);
/// A triangle of vertices that stay where they are; without area it is a segment or a point.
Convex convex_triangle(const Vec3& a, const Vec3& b, const Vec3& c);

/// A vertex of a polyhedron that is farthest along `d`. Climbs from `start` along the edges; where neighbours
/// are level within rounding (the top may then be further on) and on small polyhedra it looks at all
/// vertices.
uint32_t support_vertex(const ConvexPolyhedron& p, const Vec3& d, uint32_t start);

}  // namespace offstage::sim
