#pragma once
/// What acts on cloth from outside: gravity, fields, moving air on its triangles, pressure within (physics
/// F8, P2).

#include <span>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_state.h"
#include "sim/dynamics/force_field.h"

namespace offstage::sim {

/// The weather of a sub-step of the world.
struct ClothWeather {
  Real time, h;
  Vec3 gravity, wind;
  std::span<const ForceDef* const> forces;
};

/// Sets the accelerations of a cloth's points, those from `first` on. The drag of the air is taken at most so
/// strong that within h it brings a triangle to rest in the air, which keeps the step stable.
void add_outer_forces(const Cloth& cloth, std::size_t first, const ClothWeather& weather,
                      ClothPoints& points);

}  // namespace offstage::sim
