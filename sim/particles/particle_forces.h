#pragma once
/// The forces that act on each particle of a system independently of other particles: gravity, viscous drag,
/// a constant force, and the world's fields, moving air and grabs (physics P2).

#include <algorithm>
#include <span>
#include <vector>

#include "sim/dynamics/flat.h"
#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"
#include "sim/dynamics/stiffness.h"
#include "sim/particles/particles.h"

namespace offstage::sim {

struct ParticleForces {
  ParticleForces(const ParticleSystemDef& def, const Vec3& world_gravity, const Vec3& air,
                 std::vector<const ForceDef*> acting = {})
      : gravity(def.gravity ? world_gravity : Vec3::Zero()),
        force(def.force),
        wind(air),
        drag(def.linear_drag),
        fields(std::move(acting)) {}

  /// Acceleration by all forces except `fields` [m/s^2]; it does not depend on the position.
  Vec3 acceleration(const Vec3& v, Real mass) const {
    return gravity + (force - drag * (v - wind)) * (1 / mass);
  }
  /// Accelerations of consecutive particles by all forces; x, v and dv are flat (x y z of each). `damping`,
  /// if not empty, gets for each particle the rate at which drag reduces its velocity [1/s].
  void accelerate(Real t, std::span<const Real> x, std::span<const Real> v, std::span<const Real> mass,
                  std::span<Real> dv, std::span<Real> damping = {}) const;
  /// Returns an upper bound of the stiffness of the forces on a particle [N/m], [N s/m].
  Stiffness stiffness() const;
  /// Takes one step of IntegratorKind::leapfrog of length h [s] with consecutive particles. `fields` must be
  /// empty.
  void leapfrog_step(Real h, std::span<Vec3> x, std::span<Vec3> v, std::span<const Real> mass) const;
  /// Appends the derivatives of (dx/dt, dv/dt) of consecutive particles with respect to (x, v). The rows and
  /// columns of x begin at `at_x`, and the rows and columns of v begin at `at_v`. The derivatives of fields
  /// with respect to position are omitted, because they do not make a system stiff.
  void jacobian(Real t, std::span<const Real> x, std::span<const Real> mass, int at_x, int at_v,
                SparseEntries& entries) const;

  Vec3 gravity, force, wind;
  Real drag;
  std::vector<const ForceDef*> fields;  ///< fields of the world that act on the system in this sub-step
};

/// Dynamic system of consecutive particles in free flight. Coordinates are positions and rates are velocities
/// (x y z of each particle).
class FreeFlight final : public DynamicSystem {
 public:
  FreeFlight(const ParticleForces& forces, std::span<const Real> mass) : forces_(forces), mass_(mass) {}

  void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
    std::copy(p.begin(), p.end(), dx.begin());
  }
  void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const override {
    forces_.accelerate(t, x, p, mass_, dp);
  }
  bool force_and_damping(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp,
                         std::span<Real> damping) const override;
  void jacobian(Real t, std::span<const Real> x, std::span<const Real>,
                SparseEntries& entries) const override {
    forces_.jacobian(t, x, mass_, 0, static_cast<int>(x.size()), entries);
  }

 private:
  const ParticleForces& forces_;
  std::span<const Real> mass_;
};

}  // namespace offstage::sim
