#pragma once
/// External forces on cloth: gravity, fields and buoyancy (physics F8, P2). The forces of the air on its
/// triangles are in air_drag.h, the pressure of gas in gas_force.h.

#include <span>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_state.h"
#include "sim/dynamics/force_field.h"

namespace offstage::sim {

/// Gravity, fields and air that act on cloths in a sub-step of the world.
struct ClothWeather {
  Real time, h;
  Vec3 gravity, wind;
  std::span<const ForceDef* const> forces;
};

/// Sets for each point of a cloth: mass, acceleration by outer forces, velocity of the air, and rate of
/// linear drag. `first`: index of the cloth's first point. In a torn cloth under pressure, the mass includes
/// the gas that moves with the point.
void add_outer_forces(const Cloth& cloth, std::size_t first, const ClothWeather& weather,
                      ClothPoints& points);

/// Lets the gas of a torn cloth flow out for the time weather.h [s], and calls add_outer_forces() for the
/// next sub-step of the cloth. A bursting cloth moves too fast for forces that are constant over a sub-step
/// of the world. Returns false if no gas flows.
bool step_leak(Cloth& cloth, std::size_t first, const ClothWeather& weather, ClothPoints& points);

}  // namespace offstage::sim
