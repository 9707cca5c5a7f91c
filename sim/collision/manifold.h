#pragma once
/// Contact manifolds (physics R5): up to four points that represent where two convex solids touch, or would
/// touch if they were closer.

#include <array>
#include <cstdint>

#include "sim/collision/convex.h"
#include "sim/collision/separation.h"

namespace offstage::sim {

/// One point of a manifold.
struct ContactPoint {
  /// Points on the surfaces of A and B; on_a - on_b = separation * normal.
  Vec3 on_a = Vec3::Zero(), on_b = Vec3::Zero();
  Real separation = 0;  ///< [m], negative in penetration
  /// Identifies the two features that touch at this point: a vertex and the other solid, or two edges. The id
  /// stays the same from step to step while these features touch.
  uint32_t id = 0;
  /// For a mesh that is represented by its triangles: the triangle at this point. The points of one manifold
  /// may lie on several triangles.
  uint32_t piece = 0;
};

/// The features that define the normal. They determine how the normal turns when the bodies turn; see
/// normal_rate().
enum class NormalSource : uint8_t {
  face_of_a,  ///< the normal is fixed in A
  face_of_b,  ///< the normal is fixed in B
  edges,      ///< the normal is perpendicular to a line fixed in A and to a line fixed in B
  edge_of_a,  ///< the normal leads from a point fixed in B perpendicularly to a line fixed in A
  edge_of_b,  ///< the normal leads from a line fixed in B, perpendicularly to it, to a point fixed in A
  points,     ///< the normal leads from a point fixed in B to a point fixed in A
};

struct Manifold {
  Vec3 normal = Vec3::UnitY();  ///< unit vector from B to A
  NormalSource source = NormalSource::points;
  Vec3 edge_a = Vec3::Zero(), edge_b = Vec3::Zero();  ///< unit directions of the lines of `source`
  /// Depth of those lines and points behind the surfaces [m]: the radius for a sphere's centre or the axis of
  /// a cylinder's side, 0 for a sharp edge, a vertex or a face.
  Real radius_a = 0, radius_b = 0;
  uint32_t count = 0;
  /// Indices of the pieces of both shapes (CollisionShape::piece()). If coplanar triangles were joined, the
  /// index of the middle one.
  uint32_t piece_a = 0, piece_b = 0;
  /// Whether the surface of A (of B) is known to continue around the points in the plane perpendicular to the
  /// normal. Otherwise other pieces or bodies may be flush with it.
  bool continues_a = false, continues_b = false;
  std::array<ContactPoint, 4> points;  ///< the deepest first
};

/// Further manifolds of solids that turn relative to each other. They contain the points beyond the first
/// four. If an edge or a vertex touches, they also contain points near a face.
struct MoreManifolds {
  std::array<Manifold, 2> manifolds;
};

/// Returns the manifold of two solids around their closest (or deepest) points, in A's frame. The features of
/// both solids that face each other along the normal are found, and one is clipped against the other. Points
/// with a separation of at most `margin` [m] are kept. If there are more than four, the deepest point and
/// points that span the greatest area are kept. There is at least one point if the separation of the solids
/// is within the margin, otherwise none. If an inclined core has a radius, its contact points are offset from
/// points of the core along the normal, so all but the deepest are slightly inside the solid.
///
/// The normal is usually the normal of the separation. If a face is almost perpendicular to it, and the gap
/// along the face's normal is shorter by less than a twentieth of the margin, the face gives the normal.
/// Therefore solids at rest on each other keep their normal and their points while they rock slightly. If
/// both solids have such a face, the less inclined face gives the normal. If both are equally inclined
/// (within a thousandth), the face of the larger solid gives it, or A's face for solids of equal size.
///
/// `more`, if not null, gets the points that may touch next when the solids turn.
Manifold manifold(const Convex& a, const Convex& b, const Pose& a_from_b, const Separation& s, Real margin,
                  MoreManifolds* more = nullptr);

/// Returns the manifold of a triangle and another solid, with the normal of the triangle's face. `up` is the
/// unit normal away from the triangle, in A's frame. The points are the corners of the other solid's
/// supporting feature that are in front of the face, and the deepest points of this feature. There may be
/// none. `of_b`: whether the triangle is B. `beyond`: greatest allowed distance of points outside of the
/// edges (0,1), (1,2), (2,0) [m].
Manifold triangle_face_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, bool of_b,
                                const Vec3& up, const std::array<Real, 3>& beyond, Real margin);

/// Returns the manifold transformed by a pose. With the pose of A in the world, the result is in world
/// coordinates.
Manifold placed(const Manifold& m, const Pose& pose);

/// Returns the manifold of a solid, A, and the half-space y <= 0, B, in the frame of the half-space. The
/// error of the deepest point is at most two thousandths of the margin.
Manifold plane_manifold(const Convex& a, const Pose& plane_from_a, Real margin);

}  // namespace offstage::sim
