#pragma once
/// Tearing of cloth (physics F8): stretch springs longer than the limit break, and the adjacent triangles
/// separate.

#include "sim/cloth/cloth_state.h"

namespace offstage::sim {

/// Breaks stretch springs that are longer than the cloth's limit: those at the ends of tears and other
/// borders first, then the worst, and only one near any place in a step, because it relieves the springs
/// around it. Tears therefore propagate as lines, and an impact does not shatter the cloth. The cloth
/// separates at an end of the broken spring, along the plane across the spring: the triangles on the far side
/// get a point of their own, with its fraction of mass. Parts that are then connected by a single point are
/// separated there. Returns how many springs broke; `version` grows if any triangle changed. If these are the
/// first, the most stretched of them is stored as the cloth's first tear; `first_tear` has its time and
/// causes.
uint32_t tear(Cloth& cloth, ClothTear first_tear);

}  // namespace offstage::sim
