#pragma once
/// First contact of a moving sphere with a solid at rest (physics P3). The sphere's centre runs straight from
/// a to b.

#include <optional>

#include "sim/collision/distance.h"

namespace offstage::sim {

struct SweepHit {
  Real fraction;  ///< of the way from a to b
  Real distance;  ///< of the centre to the surface there: the sphere's radius, or less if it started closer
  Vec3 normal;    ///< outward, by the feature hit
};

/// The first place where the centre comes within `radius` of the solid while approaching it. A sphere that
/// starts closer than its radius hits at once if it approaches, and never if it leaves.
///
/// The distance to a convex set along a line is a convex function. Newton's iteration from the near side on a
/// convex function never oversteps the root and converges quadratically, and where its slope turns positive
/// there is no root ahead: this is conservative advancement with the exact bound. All primitives and all
/// triangles are convex sets, so one method serves every shape and every feature (face, edge, vertex).
std::optional<SweepHit> sweep_sphere(const Solid& s, const Vec3& a, const Vec3& b, Real radius);

}  // namespace offstage::sim
