#pragma once
/// The supporting feature of a convex solid in a direction: the face, edge or vertex with which the solid
/// would rest on a plane perpendicular to the direction. A contact manifold (manifold.h) is computed from the
/// supporting features of two solids.

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
  /// For a segment or point: `edge` is the unit direction of the touching edge, or the tangent of a rim; zero
  /// for a vertex. `rod` is the radius of curvature of a round side at this point [m].
  Vec3 edge = Vec3::Zero();
  Real rod = 0;

  bool is_face() const { return count >= 3; }
  void add(const Vec3& point, uint32_t tag) { corners[count++] = {point, tag}; }
  /// Transforms the feature to another frame.
  void place(const Mat3& rotation, const Vec3& translation);
};

/// Returns the feature that rests on the plane with the unit normal `d` that touches the solid. It is the
/// feature with the largest part within `slack` [m] of the plane. For a polyhedron it is one of the faces at
/// the support vertex; for a cylinder or cone it is the flat side or a line of the round side. A disc is
/// returned as a regular polygon on its rim, and a face with many corners is reduced to its most distant
/// corners.
SupportingFeature supporting_feature(const Convex& c, const Vec3& d, Real slack);

/// Returns the edge or point that faces `d`, but never a face. For a polyhedron it is an edge at the support
/// vertex. An edge perpendicular to `d` is preferred; otherwise the edge with the longest part within `slack`
/// [m] is returned. For a rim it is a point. `on_surface` is the touching point of the core.
SupportingFeature supporting_edge(const Convex& c, const Vec3& d, Real slack, const Vec3& on_surface);

}  // namespace offstage::sim
