/// Derivatives of the forces in a group of coupled objects, for implicit integration (physics N2). The matrix
/// has one block for each edge of the coupling graph.

#include "sim/dynamics/rigid_jacobian.h"
#include "sim/world/coupled_group.h"

namespace offstage::sim {

/// Derivatives at an end of a spring, which is attached to an object: the place and the velocity of the end
/// by the state of the object, and the rates of the object by a force at the end.
struct CoupledGroup::EndDerivative {
  using Matrix3X = Eigen::Matrix<Real, 3, Eigen::Dynamic, 0, 3, 13>;
  using MatrixX3 = Eigen::Matrix<Real, Eigen::Dynamic, 3, 0, 13, 3>;
  using MatrixX = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, 0, 13, 13>;

  StateColumns columns;
  Matrix3X position, velocity;
  MatrixX3 force;  // derivatives of the rates by the force
  MatrixX torque;  // derivatives of the rates by the state for a constant force
};

CoupledGroup::EndDerivative CoupledGroup::derivative(const End& end, const Vec3& force,
                                                     std::span<const Real> x, std::span<const Real> p) const {
  EndDerivative d;
  if (end.kind == End::Kind::particle) {
    d.columns = {static_cast<int>(particle_x(end.index)), static_cast<int>(x.size() + particle_p(end.index))};
    d.position.setZero(3, 6);
    d.velocity.setZero(3, 6);
    d.force.setZero(6, 3);
    d.torque.setZero(6, 6);
    d.position.leftCols<3>().setIdentity();
    d.velocity.rightCols<3>().setIdentity();
    d.force.bottomRows<3>().diagonal().array() = 1 / end.mass;
    return d;
  }
  const RigidStage at = stage(end.index, x, p);
  const RigidDerivative body(at);
  const Vec3 arm = at.motion.orientation * end.point;
  d.columns = {static_cast<int>(kBodyX * end.index), static_cast<int>(x.size() + kBodyP * end.index)};
  d.position = body.position(arm);
  d.velocity = body.velocity(arm);
  d.force.setZero(13, 3);
  d.force.middleRows<3>(7).setIdentity();
  d.force.bottomRows<3>() = cross_matrix(arm);
  d.torque.setZero(13, 13);
  d.torque.bottomRows<3>() = body.torque(arm, force);
  return d;
}

void CoupledGroup::add_derivatives(const ActiveSpring& s, Real t, std::span<const Real> x,
                                   std::span<const Real> p, SparseEntries& entries) const {
  const Pull f = pull(s, t, x, p);
  // The force is F_a = -(k (l - L) + c u.n) n with n = d / l and dn = (1 - n n^T) / l dd; u is the relative
  // velocity.
  const Mat3 outer = f.along * f.along.transpose(), across = Mat3::Identity() - outer;
  const Real inverse_length = f.length > 0 ? 1 / f.length : 0;
  const Mat3 by_distance = -s.stiffness * outer - f.size * inverse_length * across -
                           s.damping * inverse_length * f.along * (across * f.velocity).transpose();
  const Mat3 by_velocity = -s.damping * outer;

  const End* ends[2] = {&s.a, &s.b};
  const Real sign[2] = {1, -1};
  EndDerivative d[2];
  for (int i = 0; i < 2; ++i)
    if (ends[i]->is_moved()) d[i] = derivative(*ends[i], -sign[i] * f.size * f.along, x, p);
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 2; ++column) {
      if (!ends[row]->is_moved() || !ends[column]->is_moved()) continue;
      const EndDerivative::Matrix3X change =
          sign[row] * sign[column] * (by_distance * d[column].position + by_velocity * d[column].velocity);
      EndDerivative::MatrixX block = d[row].force * change;
      if (row == column) block += d[row].torque;
      add_block(block, d[row].columns, d[column].columns, entries);
    }
}

void CoupledGroup::jacobian(Real t, std::span<const Real> x, std::span<const Real> p,
                            SparseEntries& entries) const {
  const auto n = static_cast<int>(x.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidStage at = stage(i, x, p);
    const StateColumns columns{static_cast<int>(kBodyX * i), n + static_cast<int>(kBodyP * i)};
    add_block(RigidDerivative(at).own_rates(forces_, t), columns, columns, entries);
  }
  const auto particles_x = x.subspan(particle_x(0));
  for (const Group& g : groups_)
    g.forces.jacobian(t, g.part(particles_x), g.mass, static_cast<int>(particle_x(g.offset)),
                      n + static_cast<int>(particle_p(g.offset)), entries);
  pair_forces_.jacobian(particles_x, static_cast<int>(particle_x(0)), n + static_cast<int>(particle_p(0)),
                        entries);
  for (const ActiveSpring& s : springs_) add_derivatives(s, t, x, p, entries);
}

}  // namespace offstage::sim
