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
  /// Identifies the two features that meet here: a vertex and the other solid, or two edges. It is constant
  /// from step to step while they meet.
  uint32_t id = 0;
  /// For a mesh that is represented by its triangles: the triangle at this point. The points of one manifold
  /// may lie on several triangles.
  uint32_t piece = 0;
};

/// Features that define the normal. They determine how the normal turns with the bodies (contact_frame.h).
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

/// Further manifolds of solids that turn. They have the points beyond the first four and, if an edge or a
/// vertex touches, points near a face.
struct MoreManifolds {
  std::array<Manifold, 2> manifolds;
};

/// Returns the manifold of two solids around their closest (or deepest) points, in A's frame. The features of
/// both that face each other along the normal are found, one is clipped against the other, and points within
/// `margin` [m] of touching are kept. Of more than four points, the deepest and those that span the greatest
/// area are kept. There is at least one point if the separation is within the margin, otherwise none. Points
/// on the radius around an inclined core are placed below the core's points, so all but the deepest are
/// slightly inside the solid.
///
/// The normal is usually the normal of the separation. If a face is almost perpendicular to it, and the gap
/// along the face's normal is shorter by less than a twentieth of the margin, the face gives the normal.
/// Therefore solids at rest on each other keep their normal and their points while they rock slightly. If
/// both solids have such a face, the less inclined one gives the normal; if they are equally inclined (within
/// a thousandth), the face of the larger solid, or A's.
///
/// `more`, if not null, gets the points of turning solids that may touch next.
Manifold manifold(const Convex& a, const Convex& b, const Pose& a_from_b, const Separation& s, Real margin,
                  MoreManifolds* more = nullptr);

/// Returns the manifold of a triangle, whose face gives the normal, and the other solid. `up` is the unit
/// normal away from the triangle, in A's frame. The points are the corners of the other solid's supporting
/// feature that are in front of the face, and further points of the feature with the greatest depth. `of_b`:
/// whether the triangle is B. `beyond`: greatest allowed distance of points outside of the edges (0,1),
/// (1,2), (2,0) [m]. May have no points.
Manifold triangle_face_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, bool of_b,
                                const Vec3& up, const std::array<Real, 3>& beyond, Real margin);

/// Returns the same manifold in another frame, for instance with the pose of A in the world.
Manifold placed(const Manifold& m, const Pose& pose);

/// Returns the manifold of a solid A on the half-space y <= 0, B, in the frame of the half-space. The deepest
/// point is accurate to two thousandths of the margin for every core.
Manifold plane_manifold(const Convex& a, const Pose& plane_from_a, Real margin);

}  // namespace offstage::sim
