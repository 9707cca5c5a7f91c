#pragma once
/// Moves the points of a cloth by its springs and outer accelerations through a sub-step of length h, without
/// contacts: the other ways beside the sweep of cloth_springs.h. Points that are held have been moved
/// already.

#include <span>

#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

/// A cloth among the points of all.
struct ClothRange {
  std::size_t begin, end;
  std::span<const ClothSpring> springs;  ///< between points of all cloths
};

void step_symplectic(ClothPoints& points, const ClothRange& cloth, Real h);

/// Classical Runge-Kutta. The velocity at the end is not that of the move: `kick` gets the difference.
void step_rk4(ClothPoints& points, const ClothRange& cloth, Real h, std::span<Vec4> kick);

/// Backward Euler, linearised once. A spring that is compressed does not push sideways in it, which keeps the
/// system positive definite (Choi and Ko, "Stable but Responsive Cloth", 2002). Conjugate gradients with the
/// blocks of the diagonal as preconditioner; false if they ended at their bound.
bool step_implicit(ClothPoints& points, const ClothRange& cloth, Real h);

}  // namespace offstage::sim
