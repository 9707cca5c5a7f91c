#pragma once
/// A sphere against a sphere, a capsule or a box, in closed form.

#include "sim/collision/manifold.h"

namespace offstage::sim {

/// Whether sphere_manifold() knows these two: one is a sphere, and the other a sphere, a capsule or a box
/// without radius.
bool is_sphere_pair(const Convex& a, const Convex& b);

/// Gives their manifold, of one point, or of none if they are farther than `margin` [m] apart. The normal is
/// that of the closest feature of the other solid: exactly, other than manifold()'s.
void sphere_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin, Manifold& m);

}  // namespace offstage::sim
