#pragma once
/// Two boxes: the separating axis test (Gottschalk, Lin, Manocha, "OBBTree", 1996) on all fifteen axes, and
/// the clipping of one rectangle against the other. What is found for most pairs of bodies, and quicker than
/// by GJK.

#include "sim/collision/manifold.h"

namespace offstage::sim {

/// The manifold of two boxes without radius, as manifold() would give it, with no points if they are farther
/// than `margin` [m] apart. False, and the manifold has none either, if the axes do not tell the distance:
/// when the boxes are apart with a vertex or a parallel edge closest to an edge, or where edges are so nearly
/// parallel that rounding shows.
bool box_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin, Manifold& manifold,
                  MoreManifolds* more = nullptr);

}  // namespace offstage::sim
