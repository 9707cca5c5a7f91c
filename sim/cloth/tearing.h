#pragma once
/// Tearing of cloth (physics F8): stretch springs longer than the limit break, and the adjacent triangles
/// separate.

#include "sim/cloth/cloth_state.h"

namespace offstage::sim {

/// Breaks stretch springs that are longer than ClothDef::tear allows: first springs at the ends of tears and
/// at other borders, then the most stretched ones. In each step only one spring breaks in any neighbourhood,
/// because this relieves the springs around it. Therefore tears propagate as lines, and an impact does not
/// shatter the cloth. The cloth separates at an end of the broken spring, along the plane across the spring:
/// the triangles on the far side get a new point with a part of the mass. Parts that are then connected only
/// by a single point are separated there. Returns the number of broken springs. Cloth::version increases if
/// any triangle changed. At the first tear of the cloth, the most stretched of the broken springs is stored
/// in Cloth::first_tear; the argument `first_tear` provides time and causes.
uint32_t tear(Cloth& cloth, ClothTear first_tear);

}  // namespace offstage::sim
