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

/// Sets the accelerations and masses of a cloth's points, which begin at index `first`. The drag of the air
/// is limited so that it at most brings a triangle to rest relative to the air within h, which keeps the step
/// stable. Points of a cloth under pressure that is torn have the mass of the gas that they move, too.
void add_outer_forces(const Cloth& cloth, std::size_t first, const ClothWeather& weather,
                      ClothPoints& points);

/// Lets the gas of torn cloths flow out for a time weather.h, and sets their accelerations and masses for the
/// next sub-step: their skin moves too fast for forces that stay through a sub-step of the world. `first`
/// holds the index of each cloth's first point.
void step_leaks(std::span<Cloth* const> cloths, std::span<const std::size_t> first,
                const ClothWeather& weather, ClothPoints& points);

}  // namespace offstage::sim
