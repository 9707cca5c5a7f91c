#pragma once
/// Convex solid for GJK, the penetration test and conservative advancement. It consists of a core, given by
/// its support mapping, and a radius around the core. A sphere is a point with a radius, a capsule is a
/// segment with a radius, so distances of these round shapes are exact.

#include <array>
#include <cmath>
#include <cstdint>

#include "sim/core/types.h"
#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/shape.h"
#include "sim/geometry/solid_mesh.h"

namespace offstage::sim {

struct Convex {
  enum class Core : uint8_t { point, segment, triangle, box, cylinder, cone, ellipsoid, sector, polyhedron };

  Core core = Core::point;
  /// Size of the core [m]. Box: half sizes. Cylinder: (radius, half height, unused). Cone or frustum: (radius
  /// of the base, half height, radius of the top), where a cone's top has radius 0. Ellipsoid: half axes.
  /// Segment: half length in y. Sector of a ring: (radius, half height, radius of the inner corners).
  Vec3 half = Vec3::Zero();
  Real sine = 0, cosine = 1;  ///< sector: of half of its angle
  Real radius = 0;            ///< radius around the core [m]
  const ConvexPolyhedron* polyhedron = nullptr;
  std::array<const Vec3*, 3> corners{};  ///< corners of a triangle
  /// Pose of the core in the frame of the solid; null: the frames are the same.
  const Pose* place = nullptr;

  /// Returns the farthest point of the core along `d`, which need not be unit. `vertex`: on return the number
  /// of the point. It consists of the sign bits of a box's corner, or is the index of a segment's end or of a
  /// triangle's or polyhedron's vertex. On entry it is the vertex at which the search on a polyhedron starts.
  /// Other cores do not use it.
  Vec3 support(const Vec3& d, uint32_t& vertex) const;
  /// Whether support points are vertices that can be identified by a number.
  bool has_vertices() const {
    return core != Core::cylinder && core != Core::cone && core != Core::ellipsoid && core != Core::sector;
  }
  /// Returns the vertex of the core with a number from support(). An invalid number is mapped to some valid
  /// vertex.
  Vec3 vertex(uint32_t number) const;
  /// For a sector and a unit vector in the frame of its core: whether this direction points out of the round
  /// side, or beside it by at most `slack`.
  bool faces_arc(const Vec3& d, Real slack = 0) const {
    return d.x() > 0 && std::abs(d.z()) * cosine <= d.x() * sine + slack;
  }
  /// A point inside the core.
  Vec3 centre() const;
  /// Upper bound of the distance of the solid's points from the origin of the frame, including the radius
  /// [m]. It is the greatest distance unless the core has a place.
  Real reach() const;

 private:
  Vec3 core_support(const Vec3& d, uint32_t& vertex) const;
  Vec3 core_vertex(uint32_t number) const;
  Vec3 sector_support(const Vec3& d) const;
};

/// Returns the convex solid of a primitive. MeshShape and Plane are not accepted.
Convex convex(const Shape& primitive);
Convex convex(const ConvexPolyhedron& polyhedron, Real radius = 0);
/// Returns a round solid. Its pose must outlive the convex solid.
Convex convex(const RoundSolid& round);
/// Returns a triangle as a convex solid. It refers to the three vertices, which must outlive it. A triangle
/// without area acts as a segment or a point.
Convex convex_triangle(const Vec3& a, const Vec3& b, const Vec3& c);

/// Returns a vertex of a polyhedron that is farthest along `d`, by hill climbing along the edges from
/// `start`. All vertices are checked if the polyhedron is small, or if a neighbour of the found vertex is
/// equally far within rounding, because a third vertex may then be farther.
uint32_t support_vertex(const ConvexPolyhedron& p, const Vec3& d, uint32_t start);

}  // namespace offstage::sim
