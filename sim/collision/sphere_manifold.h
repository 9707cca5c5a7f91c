#pragma once
/// A sphere against a sphere, a capsule or a box, in closed form.

#include "sim/collision/manifold.h"

namespace offstage::sim {

/// Whether sphere_manifold() knows these two: one is a sphere, and the other a sphere, a capsule or a box
/// without radius.
bool is_sphere_pair(const Convex& a, const Convex& b);

/// Gives the manifold of two placed ones, of one point, or of none if they are farther than `margin` [m]
/// apart, in the frame in which their poses are. The normal is that of the closest feature of the other
/// solid: exactly, other than manifold()'s.
void sphere_manifold(const Convex& a, const Pose& pose_a, const Convex& b, const Pose& pose_b, Real margin,
                     Manifold& m);

}  // namespace offstage::sim
