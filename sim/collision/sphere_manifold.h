#pragma once
/// Contact of a sphere with a sphere, a capsule or a box, in closed form.

#include "sim/collision/manifold.h"

namespace offstage::sim {

/// Whether sphere_manifold() supports this pair: one solid is a sphere, and the other is a sphere, a capsule
/// or a box without radius.
bool is_sphere_pair(const Convex& a, const Convex& b);

/// Computes the manifold of two placed solids, with one point, or with none if they are more than `margin`
/// [m] apart, in the frame of the poses. The normal is exactly the normal of the closest feature of the
/// other solid; the normal of manifold() may differ from it.
void sphere_manifold(const Convex& a, const Pose& pose_a, const Convex& b, const Pose& pose_b, Real margin,
                     Manifold& m);

}  // namespace offstage::sim
