#pragma once
/// What of a convex solid faces a direction: the face, edge or vertex that rests on a plane across it.
/// Contact manifolds (manifold.h) are made of two of them.

#include <array>
#include <cstdint>

#include "sim/collision/convex.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// A convex polygon (a face), a segment or a point of the core, without the radius around it.
struct SupportingFeature {
  static constexpr uint32_t kMaxCorners = 32;
  struct Corner {
    Vec3 point;
    uint32_t tag;  ///< which vertex of the solid it is
  };

  uint32_t count = 0;
  std::array<Corner, kMaxCorners> corners;  ///< of a face counter-clockwise from outside
  Vec3 normal = Vec3::Zero();               ///< of a face: unit, outward
  Vec3 on_face = Vec3::Zero();  ///< of a face: a point of its plane; corners may lie a little lower
  uint32_t vertex = 0;          ///< where Convex::support() should start looking in this direction
  /// Of a segment or point: the unit direction of the edge at which a plane across the direction touches, be
  /// it the tangent of a rim; zero if it touches a vertex. And how far behind the surface the line lies that
  /// a round side turns about, at the point given (its radius of curvature) [m].
  Vec3 edge = Vec3::Zero();
  Real rod = 0;

  bool is_face() const { return count >= 3; }
  void add(const Vec3& point, uint32_t tag) { corners[count++] = {point, tag}; }
  /// The same in another frame.
  void place(const Mat3& rotation, const Vec3& translation);
};

/// The feature of which most lies within `slack` of the plane that `d`, unit, is normal to and that touches
/// the solid: of a polyhedron the face at the support vertex with the largest such patch (projected on the
/// plane), of a cylinder or cone the flat side or a line of the round side. Discs are given as regular
/// polygons on the rim, faces of many corners by the corners that spread farthest.
SupportingFeature supporting_feature(const Convex& c, const Vec3& d, Real slack);

/// The same without faces: of a polyhedron the edge at the support vertex that is across `d` or else the one
/// of which most lies within `slack`; of a rim a point. `on_surface` is the point of the core that is
/// touched.
SupportingFeature supporting_edge(const Convex& c, const Vec3& d, Real slack, const Vec3& on_surface);

}  // namespace offstage::sim
