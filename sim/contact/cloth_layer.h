#pragma once
/// Cloth between two bodies as a thin layer in their contacts (physics F7). A contact point whose line along
/// the normal crosses cloth keeps the distance of the layers. The contact solver then carries the load and
/// the friction from body to body, and the cloth does not have to push them apart.

#include <array>
#include <cstdint>
#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

/// A triangle of cloth near a body.
struct LayerTriangle {
  std::array<Vec3, 3> at;  ///< corners, world [m]
  Vec3 velocity;           ///< mean velocity of the corners [m/s]
  Real thickness;          ///< distance between the cloth and a body [m]
  Real friction;           ///< coefficient of friction
  uint32_t cloth;          ///< slot of the cloth
  uint32_t number;         ///< index of the triangle in the cloth
};

/// The layers of cloth that cross a line.
struct ClothLayers {
  Real distance = 0;                      ///< distance that they keep between two bodies [m]; 0: no layer
  const LayerTriangle* lowest = nullptr;  ///< the first layer along the line
};

/// Returns where the line from `middle` along `n` crosses a triangle [m], or infinity if it does not. Lines
/// that are nearly in the plane of the triangle do not cross it.
Real crossing(const LayerTriangle& triangle, const Vec3& middle, const Vec3& n);

/// Finds the layers that cross the line from `middle` along `n` (unit) at distances from -reach to reach [m].
ClothLayers layers_across(std::span<const LayerTriangle> triangles, const Vec3& middle, const Vec3& n,
                          Real reach);

}  // namespace offstage::sim
