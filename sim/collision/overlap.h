#pragma once
/// Whether two placed solids touch. Exact for planes, spheres and capsules against everything and for boxes
/// against boxes (separating axes, H7); other pairs are judged by their oriented boxes, so they may be
/// reported slightly early.

#include "sim/collision/distance.h"

namespace offstage::sim {

bool touching(const Solid& a, const Pose& world_from_a, const Solid& b, const Pose& world_from_b);

}  // namespace offstage::sim
