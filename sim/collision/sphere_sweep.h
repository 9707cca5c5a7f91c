#pragma once
/// First contact of a moving sphere with a solid at rest (physics P3). The sphere's centre moves on a
/// straight line from a to b.

#include <optional>

#include "sim/collision/distance.h"

namespace offstage::sim {

struct SweepHit {
  Real fraction;  ///< fraction of the path from a to b
  /// Distance of the sphere's centre from the surface at this position [m]. It is the sphere's radius, or
  /// less if the sphere overlapped the solid at the start.
  Real distance;
  Vec3 normal;  ///< outward normal of the feature that is hit
};

/// Returns the first position at which the sphere touches the solid while approaching it; empty if there is
/// none. A sphere that overlaps at the start hits immediately if it approaches, and never if it moves away.
///
/// The distance to a convex set along a line is a convex function. Newton's iteration on a convex function
/// from the near side never passes the root and converges quadratically; where the slope becomes positive,
/// there is no root ahead. This is conservative advancement with the exact bound. All primitives and all
/// triangles are convex sets, so one method serves every shape and every feature (face, edge, vertex).
std::optional<SweepHit> sweep_sphere(const Solid& s, const Vec3& a, const Vec3& b, Real radius);

}  // namespace offstage::sim
