#pragma once
/// Drag, lift and ram pressure of the air on a cloth (ClothAir, physics F8), and the linear drag of fields
/// and hands. The force is linearised in the velocities of the points, and the integrators make this linear
/// part implicit. Steady motion and loads at rest are exact for any step. Free decay is of second order; with
/// one step of the springs per linearisation, the decay u0 / (1 + k u0 t) of a flat cloth is exact.

#include <cstdint>
#include <vector>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_state.h"

namespace offstage::sim {

class AirDrag {
 public:
  /// Sets the cloth on which the air acts. Its points begin at index `first`, and its address must stay valid
  /// until the next call.
  void assign(const Cloth& cloth, std::size_t first);

  /// Forces the next renew() to linearise again. To be called after changes of other forces, masses or
  /// velocities.
  void expire() { left_ = 0; }
  /// Updates the linearisation if it has expired: sets ClothPoints::acceleration to the effect of outer
  /// forces and of the air at the current velocities. To be called before each sub-step of the cloth, of
  /// length dt [s]. `substeps`: number of sub-steps of the cloth that are left in the world's sub-step;
  /// `steps`: steps of the integrator in each of them.
  void renew(ClothPoints& points, Real dt, uint32_t substeps, uint32_t steps);
  /// Returns whether the force of the air does not depend on the velocities of the points.
  bool empty() const { return !is_active_; }

  /// Prepares respond() for steps of length h [s].
  void begin(Real h);
  /// Returns the change of the acceleration of the cloth's point i [m/s^2] if its velocity is v instead of
  /// from(i).
  Vec4 change(std::size_t i, const Vec4& v) const { return -times(resistance_[i], v - from_[i]); }
  /// Returns the part of a change of velocity dv that remains after the drag of a step, (1 + h R)^-1 dv.
  Vec4 respond(std::size_t i, const Vec4& dv) const { return times(response_[i], dv); }
  /// Returns the matrix R of point i: decrease of its acceleration per unit of velocity [1/s].
  Mat3 resistance(std::size_t i) const { return resistance_[i].topRows<3>(); }
  /// Returns the velocity for which the accelerations of the points were computed.
  const Vec4& from(std::size_t i) const { return from_[i]; }

 private:
  using Columns = Eigen::Matrix<Real, 4, 3>;  // the fourth row is 0

  static Vec4 times(const Columns& m, const Vec4& v) {
    return v[0] * m.col(0) + v[1] * m.col(1) + v[2] * m.col(2);
  }
  uint32_t substeps_until_change(const ClothPoints& points, Real dt) const;
  void drag_points(ClothPoints& points);
  void drag_triangles(ClothPoints& points);
  void catch_air(ClothPoints& points);

  const Cloth* cloth_ = nullptr;
  std::size_t first_ = 0;
  Real lightness_ = 0;   // greatest area per mass of a point [m^2/kg]
  uint32_t left_ = 0;    // number of sub-steps for which the linearisation is still kept
  Real span_ = 0;        // total time for which it is kept [s]
  Real fraction_ = 0.5;  // fraction of the linear part that is implicit
  bool is_active_ = false;
  std::vector<Columns> resistance_, response_;
  std::vector<Vec4> from_;
  Real prepared_for_ = -1;  // step [s]; < 0: none
};

}  // namespace offstage::sim
