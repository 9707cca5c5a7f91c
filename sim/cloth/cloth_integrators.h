#pragma once
/// Integrators of cloth: they move the points of a cloth through a sub-step of length h [s] under springs,
/// bending, gas and outer accelerations. `relaxed` and `implicit` also keep points above their supports
/// (ClothPoints::supports), and `relaxed` keeps triangles above theirs and limits bending. Drag is implicit
/// in all of them (air_drag.h). Pinned points must already have been moved. If the velocity at the end
/// differs from displacement / h, the difference is stored in `kick`.

#include <algorithm>
#include <span>

#include "sim/cloth/air_drag.h"
#include "sim/cloth/bend_limit.h"
#include "sim/cloth/bending.h"
#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_springs.h"
#include "sim/cloth/gas_force.h"

namespace offstage::sim {

/// The points and springs of one cloth.
struct ClothRange {
  std::size_t begin, end;
  /// Springs of this cloth; their ends are indices into the points of all cloths.
  std::span<const ClothSpring> springs;
  ClothBending& bending;
  AirDrag& air;
  GasForce& gas;
  BendLimit* bend_limit;        ///< null: none
  std::span<Carrier> carriers;  ///< the dynamic bodies that hold points of any cloth

  /// Returns the supports of this cloth's points.
  std::span<Support> supports(ClothPoints& points) const {
    const auto first = std::ranges::lower_bound(points.supports, begin, {}, &Support::point);
    return {first, std::ranges::lower_bound(first, points.supports.end(), end, {}, &Support::point)};
  }
  /// Returns the supports of this cloth's triangles.
  std::span<TriangleSupport> triangle_supports(ClothPoints& points) const {
    return points.triangle_supports[points.cloth[begin]];
  }
  /// Returns the part of an array over all points that belongs to this cloth.
  template <class T>
  std::span<T> part(std::vector<T>& of_all) const {
    return std::span<T>(of_all).subspan(begin, end - begin);
  }
  template <class T>
  std::span<const T> part(const std::vector<T>& of_all) const {
    return std::span<const T>(of_all).subspan(begin, end - begin);
  }
};

/// Integrates by Gauss-Seidel sweeps (cloth_springs.h) in `steps` equal steps. Returns false if stiff bending
/// was not solved to its tolerance.
bool step_relaxed(ClothPoints& points, const ClothRange& cloth, ClothSprings& springs, uint32_t steps, Real h,
                  std::span<Vec4> kick);

void step_symplectic(ClothPoints& points, const ClothRange& cloth, Real h);

/// Integrates by the classical Runge-Kutta method of fourth order.
void step_rk4(ClothPoints& points, const ClothRange& cloth, Real h, std::span<Vec4> kick);

/// Integrates by backward Euler, linearised once. In the linearisation a compressed spring has no force
/// across its direction, which keeps the system positive definite (Choi and Ko, "Stable but Responsive
/// Cloth", 2002). The system is solved by conjugate gradients with a block-diagonal preconditioner. Returns
/// false if these reached the limit of iterations.
bool step_implicit(ClothPoints& points, const ClothRange& cloth, Real h);

}  // namespace offstage::sim
