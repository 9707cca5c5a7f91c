#pragma once
/// The response of a free rigid body to impulses, as 6 x 6 matrices.

#include "sim/core/twist.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// Returns [linear, angular] as one vector.
inline Vec6 stacked(const Vec3& linear, const Vec3& angular) {
  Vec6 all;
  all << linear, angular;
  return all;
}
inline Vec6 stacked(const Wrench& w) {
  return stacked(w.force, w.torque);
}

/// Returns the matrix E for which E [v, w] is the velocity of the point at `arm` from the centre of mass. An
/// impulse P at this point is the impulse and angular impulse E^T P.
inline Eigen::Matrix<Real, 3, 6> point_velocity(const Vec3& arm) {
  Eigen::Matrix<Real, 3, 6> E;
  E << Mat3::Identity(), -cross_matrix(arm);
  return E;
}

/// Returns the mobility of a body without contacts and joints: its change of velocity and angular velocity
/// per unit of impulse and angular impulse at the centre of mass, world axes.
inline Mat6 free_mobility(Real inverse_mass, const Mat3& inverse_inertia) {
  Mat6 mobility = Mat6::Zero();
  mobility.topLeftCorner<3, 3>().diagonal().setConstant(inverse_mass);
  mobility.bottomRightCorner<3, 3>() = inverse_inertia;
  return mobility;
}

}  // namespace offstage::sim
