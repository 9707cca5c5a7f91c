#pragma once
/// Contact of two boxes: the separating axis test (Gottschalk, Lin, Manocha, "OBBTree", 1996) on all fifteen
/// axes, and the clipping of one rectangle against the other. It covers most pairs of boxes and is faster
/// than GJK.

#include "sim/collision/manifold.h"

namespace offstage::sim {

/// Computes the same manifold as manifold() for two boxes with Convex::radius 0. It has no points if the
/// boxes are more than `margin` [m] apart. Returns false, with an empty manifold, if the separating axes do
/// not give the distance. This is the case for separate boxes whose closest features are a vertex and an
/// edge, two parallel edges, or edges that are parallel within rounding.
bool box_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin, Manifold& manifold,
                  MoreManifolds* more = nullptr);

}  // namespace offstage::sim
