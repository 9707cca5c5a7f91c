#pragma once
/// Penetration depth by the expanding polytope algorithm: van den Bergen, "Proximity queries and penetration
/// depth computation on 3D game objects" (2001). The algorithm starts with a polytope inside A - B. It
/// repeatedly adds the support point beyond the face that is nearest to the origin, until that face is a face
/// of A - B. Distances of faces are signed, so touching is not a special case: an origin slightly outside
/// gets a small positive distance along the same normal.

#include "sim/collision/simplex.h"

namespace offstage::sim {

/// The point of the surface of A - B that is nearest to the origin. The origin is inside A - B, or slightly
/// outside.
struct DeepestPoint {
  Vec3 normal;  ///< unit, into A - B
  /// Signed distance of the origin, negative inside: normal.w = distance for the plane through the point.
  Real distance;
  Vec3 on_a;  ///< the corresponding point of A's core
  int iterations = 0;
  bool converged = true;
};

/// Computes the surface point of A - B nearest to the origin. `s`: on entry a simplex that contains the
/// origin or is nearest to it; on return the face that contains the result. If A - B is flat, the distance is
/// 0 within rounding, and the normal is perpendicular to A - B, on the side of `sense`.
DeepestPoint deepest_point(const MinkowskiDifference& m, Simplex& s, const Vec3& sense);

}  // namespace offstage::sim
