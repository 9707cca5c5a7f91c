#pragma once
/// The pressure of the gas in a closed cloth, as a force that changes with the shape of the cloth (physics
/// F8). The weight of the gas and its buoyancy are among the outer forces (cloth_forces.h).

#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_state.h"

namespace offstage::sim {

/// The gas inside of a cloth with `pressure`; zero for other cloths.
ClothGasState gas_state(const Cloth& cloth);

/// Whether gas flows out of a tear.
bool leaks(const Cloth& cloth);

/// Lets the gas of a torn cloth flow out for the time h [s].
void leak(Cloth& cloth, Real h);

/// Returns the mass of the gas and air that a skin of unit area moves when it bursts [kg/m^2].
Real moved_with_skin(const Cloth& cloth);

class GasForce {
 public:
  /// `cloth` must outlive this object.
  explicit GasForce(const Cloth& cloth) : cloth_(&cloth) {}

  /// Whether the cloth contains gas under pressure.
  bool acts() const {
    return cloth_->def.pressure != 0 && !cloth_->stopped && cloth_->gas.remaining_fraction() > 0;
  }
  /// Adds the forces of the gas on the points of the cloth at the positions x, times `factor`. There must be
  /// gas under pressure.
  void add_forces(std::span<const Vec4> x, Real factor, std::span<Vec4> force);

 private:
  const Cloth* cloth_;
  std::vector<Vec4> doubled_;  // by point: sum of the doubled area vectors of its triangles [m^2]
  std::vector<Vec3> at_;       // positions of the points of a torn cloth
};

}  // namespace offstage::sim
