#pragma once
/// The feature of a convex solid that faces a direction: the face, edge or vertex that rests on a plane
/// perpendicular to it. Contact manifolds (manifold.h) are made of two of them.

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
    uint32_t tag;  ///< number of the solid's vertex
  };

  uint32_t count = 0;
  std::array<Corner, kMaxCorners> corners;  ///< the corners of a face are counter-clockwise from outside
  Vec3 normal = Vec3::Zero();               ///< unit outward normal of a face
  Vec3 on_face = Vec3::Zero();  ///< a point of the plane of a face; corners may lie slightly lower
  uint32_t vertex = 0;          ///< start vertex for Convex::support() in this direction
  /// For a segment or point: the unit direction of the edge at which a plane perpendicular to the direction
  /// touches, or the tangent of a rim; zero for a vertex. And the distance from the surface to the line about
  /// which a round side turns, at the given point (its radius of curvature) [m].
  Vec3 edge = Vec3::Zero();
  Real rod = 0;

  bool is_face() const { return count >= 3; }
  void add(const Vec3& point, uint32_t tag) { corners[count++] = {point, tag}; }
  /// Transforms the feature to another frame.
  void place(const Mat3& rotation, const Vec3& translation);
};

/// Returns the feature with the largest part within `slack` of the plane that touches the solid and has the
/// unit normal `d`. For a polyhedron it is the face at the support vertex with the largest such part
/// (projected on the plane), for a cylinder or cone the flat side or a line of the round side. Discs are
/// given as regular polygons on the rim, and faces with many corners by their most distant corners.
SupportingFeature supporting_feature(const Convex& c, const Vec3& d, Real slack);

/// Returns the edge or point that faces `d`, but never a face. For a polyhedron it is the edge at the support
/// vertex that is perpendicular to `d`, or else the one with the longest part within `slack`; for a rim it is
/// a point. `on_surface` is the touching point of the core.
SupportingFeature supporting_edge(const Convex& c, const Vec3& d, Real slack, const Vec3& on_surface);

}  // namespace offstage::sim
