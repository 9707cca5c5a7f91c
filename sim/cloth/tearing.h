#pragma once
/// Tearing (physics F8): stretch springs over the limit break, and the triangles beside part.

#include "sim/cloth/cloth_state.h"

namespace offstage::sim {

/// Breaks the stretch springs that are longer than the cloth's limit, the worst first, and at most one at any
/// point: each relieves those around it. The cloth parts through the end of a broken spring with more
/// triangles around, along the plane across the spring: the triangles on its far side get a point of their
/// own, with its share of mass. Ends that are pinned or on a border come loose only as far as the triangles
/// around let them. Returns how many springs broke; `version` grows if any triangle changed.
uint32_t tear(Cloth& cloth);

}  // namespace offstage::sim
