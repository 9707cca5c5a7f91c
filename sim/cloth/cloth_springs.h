#pragma once
/// The springs of cloths as compliant constraints (Macklin, Mueller, Chentanez, "XPBD", 2016), swept over
/// once per small sub-step (Macklin et al., "Small Steps in Physics Simulation", 2019). Springs of a colour
/// share no point, so that a sweep gives the same bits on any number of threads.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class ClothSprings {
 public:
  /// Springs between points of all cloths; their order decides about colours.
  void assign(std::span<const ClothSpring> springs, std::size_t point_count);

  /// One sweep over all springs on positions that moved from their start over h. Always in the same order:
  /// changing it from step to step would have no state of rest. No over-relaxation: it excites the highest
  /// mode.
  void sweep(ClothPoints& points, Real h) const;

  std::size_t size() const { return spring_.size(); }

 private:
  struct Spring {
    uint32_t a, b;
    Real rest, compliance, damping;  // compliance: 1/k; damping: c/k
  };

  void sweep_block(ClothPoints& points, Real h, std::size_t begin, std::size_t end) const;

  std::vector<Spring> spring_;            // by colour
  std::vector<std::size_t> color_start_;  // and the end
};

}  // namespace offstage::sim
