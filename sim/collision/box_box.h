#pragma once
/// Contact of two boxes: the separating axis test (Gottschalk, Lin, Manocha, "OBBTree", 1996) on all fifteen
/// axes, and the clipping of one rectangle against the other. It covers most pairs of boxes and is faster
/// than GJK.

#include "sim/collision/manifold.h"

namespace offstage::sim {

/// Computes the manifold of two boxes without radius, as manifold() does; without points if they are more
/// than `margin` [m] apart. Returns false, with an empty manifold, if the axes do not give the distance: when
/// the boxes are separate and a vertex or a parallel edge is closest to an edge, or when edges are parallel
/// within rounding.
bool box_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin, Manifold& manifold,
                  MoreManifolds* more = nullptr);

}  // namespace offstage::sim
