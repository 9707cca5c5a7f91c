#include "sim/dynamics/rigid_jacobian.h"

#include "sim/core/twist.h"

namespace offstage::sim {
namespace {

/// First index of each part of a body's state among its 13 numbers.
constexpr int kTurnRow = 3, kMomentum = 7, kAngularMomentum = 10;

/// Returns the matrix of w -> (0, w) q, in the order x y z w.
Eigen::Matrix<Real, 4, 3> left_product(const Eigen::Vector4d& q) {
  Eigen::Matrix<Real, 4, 3> m;
  m.topRows<3>() = q.w() * Mat3::Identity() - cross_matrix(q.head<3>());
  m.row(3) = -q.head<3>().transpose();
  return m;
}

/// Returns the matrix of q -> (0, w) q.
Eigen::Matrix4d turning(const Vec3& w) {
  Eigen::Matrix4d m;
  m.topLeftCorner<3, 3>() = cross_matrix(w);
  m.topRightCorner<3, 1>() = w;
  m.bottomLeftCorner<1, 3>() = -w.transpose();
  m(3, 3) = 0;
  return m;
}

}  // namespace

RigidDerivative::RigidDerivative(const RigidStage& stage) : stage_(stage) {
  const Mat3 R = stage.motion.orientation.toRotationMatrix();
  inverse_inertia_ = R * stage.body.inverse_inertia * R.transpose();
  rotation_ = 2 / stage.turn.squaredNorm() * left_product(stage.turn).transpose();
  // This is dw = I^-1 dH + d_theta x w - I^-1 (d_theta x H).
  angular_velocity_.setZero();
  angular_velocity_.middleCols<4>(kTurnRow) = (inverse_inertia_ * cross_matrix(stage.angular_momentum) -
                                               cross_matrix(stage.motion.angular_velocity)) *
                                              rotation_;
  angular_velocity_.middleCols<3>(kAngularMomentum) = inverse_inertia_;
}

PointDerivative RigidDerivative::position(const Vec3& arm) const {
  PointDerivative d = PointDerivative::Zero();
  d.leftCols<3>().setIdentity();
  d.middleCols<4>(kTurnRow) = -cross_matrix(arm) * rotation_;
  return d;
}

PointDerivative RigidDerivative::velocity(const Vec3& arm) const {
  const Mat3 by_arm = cross_matrix(arm);
  PointDerivative d = -by_arm * angular_velocity_;
  d.middleCols<4>(kTurnRow) -= cross_matrix(stage_.motion.angular_velocity) * by_arm * rotation_;
  d.middleCols<3>(kMomentum).diagonal().array() += 1 / stage_.body.mass;
  return d;
}

PointDerivative RigidDerivative::torque(const Vec3& arm, const Vec3& force) const {
  // This is (d_theta x arm) x F.
  PointDerivative d = PointDerivative::Zero();
  d.middleCols<4>(kTurnRow) = cross_matrix(force) * cross_matrix(arm) * rotation_;
  return d;
}

Eigen::Matrix<Real, 13, 13> RigidDerivative::own_rates(const BodyForces& forces, Real t) const {
  const RigidBody& body = stage_.body;
  Eigen::Matrix<Real, 13, 13> d = Eigen::Matrix<Real, 13, 13>::Zero();
  d.block<3, 3>(0, kMomentum).diagonal().array() = 1 / body.mass;
  d.middleRows<4>(kTurnRow) = 0.5 * left_product(stage_.turn) * angular_velocity_;
  d.block<4, 4>(kTurnRow, kTurnRow) += 0.5 * turning(stage_.motion.angular_velocity);
  d.block<3, 3>(kMomentum, kMomentum).diagonal().array() -= body.linear_drag / body.mass;
  d.bottomRows<3>() = -body.angular_drag * angular_velocity_;
  for (const ActiveForce& f : forces.forces) {
    if (!f.acts_on(body)) continue;
    const Real drag = std::visit(
        [&](const auto& effect) -> Real {
          if constexpr (requires { effect.drag; })
            return effect.drag * strength(effect.region, effect.drop_rate, stage_.motion.position);
          return 0;
        },
        f.def->effect);
    d.block<3, 3>(kMomentum, kMomentum).diagonal().array() -= drag / body.mass;
    if (const auto* grab = std::get_if<Grab>(&f.def->effect)) {
      const Vec3 arm = stage_.motion.orientation * (grab->point - body.centre);
      const Vec3 force = effect_wrench(*f.def, forces.inside(t), stage_.motion, body.centre).force;
      const PointDerivative pull = -grab->stiffness * position(arm) - grab->damping * velocity(arm);
      d.middleRows<3>(kMomentum) += pull;
      d.bottomRows<3>() += cross_matrix(arm) * pull + torque(arm, force);
    }
  }
  return d;
}

void add_block(const Eigen::Ref<const Eigen::MatrixXd>& block, const StateColumns& rows,
               const StateColumns& columns, SparseEntries& entries) {
  // The state of a body begins with 7 coordinates, the state of a particle with 3.
  const auto place = [](const StateColumns& at, Eigen::Index i, Eigen::Index size) {
    const auto coordinates = size == 13 ? static_cast<Eigen::Index>(kBodyX) : 3;
    return static_cast<int>(i < coordinates ? at.x + i : at.p + (i - coordinates));
  };
  for (Eigen::Index column = 0; column < block.cols(); ++column)
    for (Eigen::Index row = 0; row < block.rows(); ++row)
      entries.emplace_back(place(rows, row, block.rows()), place(columns, column, block.cols()),
                           block(row, column));
}

}  // namespace offstage::sim
