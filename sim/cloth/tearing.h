#pragma once
/// Tearing (physics F8): stretch springs over the limit break, and the triangles beside part.

#include "sim/cloth/cloth_state.h"

namespace offstage::sim {

/// Breaks stretch springs that are longer than the cloth's limit: those at the ends of tears and other
/// borders first, then the worst, and only one near any place in a step, for it relieves those around it. So
/// tears run on as lines, and an impact does not shatter the cloth. It parts through an end of the broken spring
/// along the plane across it: the triangles on the far side get a point of their own, with its share of mass.
/// What then holds together by a mere point comes apart there. Returns how many springs broke; `version`
/// grows if any triangle changed.
uint32_t tear(Cloth& cloth);

}  // namespace offstage::sim
