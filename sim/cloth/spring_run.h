#pragma once
/// Positions or velocities of the points of one cloth within a sub-step, for the integrators of cloth.

#include <vector>

#include "sim/cloth/cloth_integrators.h"

namespace offstage::sim {

using SpringRun = std::vector<Vec4>;

inline bool is_held(const ClothPoints& points, std::size_t i) {
  return !(points.inverse_mass[i] > 0);
}

/// Velocity of a pinned point through the sub-step.
inline Vec4 held_velocity(const ClothPoints& points, std::size_t i, Real h) {
  return (points.position[i] - points.start[i]) / h;
}

/// Sets x and v to the state at the start of a run, with the velocities of pinned points.
inline void begin_run(const ClothPoints& points, const ClothRange& cloth, Real h, SpringRun& x,
                      SpringRun& v) {
  x.assign(points.start.begin() + static_cast<std::ptrdiff_t>(cloth.begin),
           points.start.begin() + static_cast<std::ptrdiff_t>(cloth.end));
  v.resize(x.size());
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::size_t k = cloth.begin + i;
    v[i] = is_held(points, k) ? held_velocity(points, k, h) : points.velocity[k];
  }
}

}  // namespace offstage::sim
