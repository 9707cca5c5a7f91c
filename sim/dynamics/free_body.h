#pragma once
/// Bodies as dynamic systems (physics R1, R2), and the motion of a body without springs and joints. The
/// motion is exact where it has a closed form; otherwise an integrator computes its 13 numbers.

#include <algorithm>
#include <limits>
#include <span>

#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"
#include "sim/dynamics/rigid_body.h"
#include "sim/dynamics/stiffness.h"

namespace offstage::sim {

/// Size of a body in a flat state: x = [position 3, quaternion x y z w], p = [L 3, H 3].
constexpr std::size_t kBodyX = 7, kBodyP = 6;

/// The forces that act on each body independently of other bodies.
struct BodyForces {
  Vec3 gravity;
  std::span<const ActiveForce> forces;
  Vec3 wind = Vec3::Zero();  ///< velocity of the air, to which the drag of the bodies is relative [m/s]
  /// Forces may jump at the ends of a sub-step. They have the values of the times from `first` to `last`,
  /// which lie just inside of it [s].
  Real first = -std::numeric_limits<Real>::infinity(), last = std::numeric_limits<Real>::infinity();

  Real inside(Real t) const { return std::clamp(t, first, last); }
};

/// The state of a body at a stage of an integrator. Its quaternion need not have unit length.
struct RigidStage {
  RigidStage(const RigidBody& rigid, std::span<const Real> x, std::span<const Real> p);

  void velocity(std::span<Real> dx) const;
  void force(const BodyForces& forces, Real t, std::span<Real> dp) const;

  const RigidBody& body;
  Eigen::Vector4d turn;  ///< the quaternion, not normalized
  RigidMotion motion;
  Vec3 angular_momentum;
};

void load(const RigidBody& body, std::span<Real> x, std::span<Real> p);
void store(std::span<const Real> x, std::span<const Real> p, RigidBody& body);

/// Returns an upper bound of the stiffness of the forces on a body, per mass and per moment of inertia.
Stiffness stiffness(const RigidBody& body, const BodyForces& forces);

/// The dynamic system of a single body.
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

/// Upper bound of the angular speed that a body can reach in free rotation with its current angular momentum
/// [rad/s].
Real greatest_spin(const RigidBody& body);

/// Returns the rotation by a constant angular velocity w [rad/s] over a time h [s], computed by a series. The
/// result is bitwise identical on all machines.
Quat rotation(const Vec3& w, Real h);

/// Advances a body on which only `forces` act from t to t + h. Without drag and fields the centre of mass
/// follows its parabola exactly with every integrator. A body without spin, or with the same inertia about
/// all axes, also rotates exactly.
void fly(RigidBody& body, const BodyForces& forces, const Integrator& integrator, Real t, Real h,
         IntegratorWorkspace& work);

}  // namespace offstage::sim
