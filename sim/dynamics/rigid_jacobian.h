#pragma once
/// Derivatives of what acts on rigid bodies by their states, for implicit integration (physics N2). A body's
/// 13 numbers are in the order position, quaternion, L, H. A change dq of the quaternion q turns the body by
/// d_theta = 2 vec(dq conj(q)) / |q|^2; only that matters.

#include "sim/dynamics/free_body.h"

namespace offstage::sim {

/// Where the numbers of an object stand in the state: its first coordinate and its first rate.
struct StateColumns {
  int x, p;
};

/// Three numbers by the state of a body.
using PointDerivative = Eigen::Matrix<Real, 3, 13>;

class RigidDerivative {
 public:
  explicit RigidDerivative(const RigidStage& stage);

  /// The rates of the body by its own state: its motion, drag, wind and grabs. How fields change from place
  /// to place is left out; that is never stiff.
  Eigen::Matrix<Real, 13, 13> own_rates(const BodyForces& forces, Real t) const;

  /// Of the position and the velocity of the point at `arm` from the centre of mass, which turns with the
  /// body.
  PointDerivative position(const Vec3& arm) const;
  PointDerivative velocity(const Vec3& arm) const;
  /// Of the torque arm x force, with the force constant.
  PointDerivative torque(const Vec3& arm, const Vec3& force) const;

 private:
  const RigidStage& stage_;
  Mat3 inverse_inertia_;                // world
  Eigen::Matrix<Real, 3, 4> rotation_;  // d_theta / dq
  PointDerivative angular_velocity_;
};

/// v x.
Mat3 cross_matrix(const Vec3& v);

/// Adds a block whose rows and columns are objects' numbers, coordinates first; 13 for a body, 6 for a
/// particle.
void add_block(const Eigen::Ref<const Eigen::MatrixXd>& block, const StateColumns& rows,
               const StateColumns& columns, SparseEntries& entries);

}  // namespace offstage::sim
