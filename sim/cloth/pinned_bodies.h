#pragma once
/// Dynamic bodies that hold points of a cloth by pins, in a sub-step of the integrator `relaxed`. They move
/// in each step of the springs. If a body followed only after the sub-step, the springs would pull it too far
/// where the cloth that they move in a sub-step is heavier than the body, or has a greater moment of inertia.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class PinnedBodies {
 public:
  /// The sub-step of the cloth has `steps` steps of length h [s].
  PinnedBodies(const ClothPoints& points, const ClothRange& cloth, uint32_t steps, Real h);

  /// Sets the moves and velocities of the points for the next step: those of the path of their body, and of
  /// the impulses so far.
  void begin_step(ClothPoints& points) const;
  /// Moves bodies and points by the impulses on the points (ClothPoints::pin_impulse) in step `step`.
  void end_step(ClothPoints& points, uint32_t step);

 private:
  struct Holder {
    Carrier* carrier;
    Mat6 mobility;  // of the body and its points
    Vec6 gained;    // change of [velocity, angular velocity] so far in the sub-step
    std::vector<uint32_t> points;
    std::vector<Vec3> arms;
    std::vector<Vec4> path;   // move of each point in a step without these impulses
    std::vector<Vec4> taken;  // `pin_impulse` of each point in the steps so far
  };

  uint32_t steps_;
  Real h_;
  std::vector<Holder> holders_;
};

/// Returns the longest step of the springs [s] in which the springs at the pins of dynamic bodies do not pull
/// these too far; infinite without such pins. A body has the mobility W with the mass of its pinned points.
Real longest_pin_step(const ClothPoints& points, std::span<const ClothSpring> springs,
                      std::span<const Carrier> carriers);

}  // namespace offstage::sim
