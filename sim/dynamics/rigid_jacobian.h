#pragma once
/// Derivatives of the rates of rigid bodies with respect to their states, for implicit integration (physics
/// N2). A body's 13 numbers are in the order position, quaternion, L, H. A change dq of the quaternion q
/// rotates the body by d_theta = 2 vec(dq conj(q)) / |q|^2; the other component of dq has no effect.

#include "sim/dynamics/free_body.h"

namespace offstage::sim {

/// Indices of an object in the state vector: its first coordinate and its first rate.
struct StateColumns {
  int x, p;
};

/// Derivative of three numbers with respect to the state of a body.
using PointDerivative = Eigen::Matrix<Real, 3, 13>;

class RigidDerivative {
 public:
  explicit RigidDerivative(const RigidStage& stage);

  /// Derivative of the body's rates with respect to its own state, due to motion, drag, wind and grabs. The
  /// derivatives of fields with respect to position are omitted, because they are never stiff.
  Eigen::Matrix<Real, 13, 13> own_rates(const BodyForces& forces, Real t) const;

  /// Derivative of the position, or of the velocity, of the body's material point at `arm` from the centre of
  /// mass (world axes).
  PointDerivative position(const Vec3& arm) const;
  PointDerivative velocity(const Vec3& arm) const;
  /// Derivative of the torque arm x force for a constant force.
  PointDerivative torque(const Vec3& arm, const Vec3& force) const;

 private:
  const RigidStage& stage_;
  Mat3 inverse_inertia_;                // world
  Eigen::Matrix<Real, 3, 4> rotation_;  // d_theta / dq
  PointDerivative angular_velocity_;
};

/// Adds a block of derivatives between two objects, coordinates first: 13 numbers for a body, 6 for a
/// particle.
void add_block(const Eigen::Ref<const Eigen::MatrixXd>& block, const StateColumns& rows,
               const StateColumns& columns, SparseEntries& entries);

}  // namespace offstage::sim
