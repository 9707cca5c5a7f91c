#pragma once
/// Bodies as dynamic systems (physics R1, R2), and the flight of one that nothing else holds: exact where
/// there is a closed form, else by an integrator on 13 numbers.

#include <span>

#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"
#include "sim/dynamics/rigid_body.h"

namespace offstage::sim {

/// Of each body in a flat state: x = [position 3, quaternion x y z w], p = [L 3, H 3].
constexpr std::size_t kBodyX = 7, kBodyP = 6;

/// What acts on every body by itself.
struct BodyForces {
  Vec3 gravity;
  std::span<const ActiveForce> forces;
};

/// The state of a body as an integrator sees it, at one of its stages. The quaternion there need not have
/// unit length.
struct RigidStage {
  RigidStage(const RigidBody& rigid, std::span<const Real> x, std::span<const Real> p);

  void velocity(std::span<Real> dx) const;
  void force(const BodyForces& forces, Real t, std::span<Real> dp) const;

  const RigidBody& body;
  Eigen::Vector4d turn;  ///< the quaternion as it is
  RigidMotion motion;
  Vec3 angular_momentum;
};

void load(const RigidBody& body, std::span<Real> x, std::span<Real> p);
void store(std::span<const Real> x, std::span<const Real> p, RigidBody& body);

/// A body alone.
class FreeBody final : public DynamicSystem {
 public:
  FreeBody(const RigidBody& body, const BodyForces& forces) : body_(body), forces_(forces) {}

  void velocity(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dx) const override;
  void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const override;
  void jacobian(Real t, std::span<const Real> x, std::span<const Real> p,
                SparseEntries& entries) const override;

 private:
  const RigidBody& body_;
  const BodyForces& forces_;
};

/// A bound on the spin that a body can come to have while it turns freely, by its angular momentum [rad/s].
Real greatest_spin(const RigidBody& body);

/// exp(h w / 2): the rotation by a constant angular velocity w over a time h, by a series that gives the same
/// bits everywhere.
Quat rotation(const Vec3& w, Real h);

/// Advances a body that nothing but `forces` acts on from t to t + h. Without drag and fields it falls along
/// its parabola exactly, whatever the integrator, and one with the same inertia about all axes, or without
/// spin, turns exactly too.
void fly(RigidBody& body, const BodyForces& forces, const Integrator& integrator, Real t, Real h,
         IntegratorWorkspace& work);

}  // namespace offstage::sim
