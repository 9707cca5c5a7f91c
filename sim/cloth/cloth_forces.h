#pragma once
/// External forces on cloth: gravity, fields, aerodynamic forces on its triangles and internal pressure
/// (physics F8, P2).

#include <span>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_state.h"
#include "sim/dynamics/force_field.h"

namespace offstage::sim {

/// Fields and air of a sub-step of the world.
struct ClothWeather {
  Real time, h;
  Vec3 gravity, wind;
  std::span<const ForceDef* const> forces;
};

/// Lets the gas of a cloth under pressure flow out of its tears for a time h [s].
void leak_gas(Cloth& cloth, Real h);

/// Sets the accelerations of a cloth's points, which begin at index `first`. The drag of the air is limited
/// so that it at most brings a triangle to rest relative to the air within h, which keeps the step stable.
void add_outer_forces(const Cloth& cloth, std::size_t first, const ClothWeather& weather,
                      ClothPoints& points);

}  // namespace offstage::sim
