#pragma once
/// The forces that act on each particle of a system alone: gravity, viscous drag, a constant force (physics
/// P2).

#include <algorithm>
#include <span>

#include "sim/dynamics/flat.h"
#include "sim/dynamics/integrator.h"
#include "sim/dynamics/particles.h"

namespace offstage::sim {

struct ParticleForces {
  ParticleForces(const ParticleSystemDef& def, const Vec3& world_gravity, const Vec3& air)
      : gravity(def.gravity ? world_gravity : Vec3::Zero()),
        force(def.force),
        wind(air),
        drag(def.linear_drag) {}

  Vec3 acceleration(const Vec3& v, Real mass) const {
    return gravity + (force - drag * (v - wind)) * (1 / mass);
  }

  Vec3 gravity, force, wind;
  Real drag;
};

/// A run of particles in free flight. The state is position and velocity, x y z after each other.
class FreeFlight final : public DynamicSystem {
 public:
  FreeFlight(const ParticleForces& forces, std::span<const Real> mass) : forces_(forces), mass_(mass) {}

  void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
    std::copy(p.begin(), p.end(), dx.begin());
  }
  void force(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dp) const override {
    for (std::size_t i = 0; i < mass_.size(); ++i)
      vec3(dp, 3 * i) = forces_.acceleration(vec3(p, 3 * i), mass_[i]);
  }
  void jacobian(Real, std::span<const Real> x, std::span<const Real>, SparseEntries& entries) const override {
    const auto n = static_cast<int>(x.size());
    for (int i = 0; i < n; ++i) {
      entries.emplace_back(i, n + i, 1);
      entries.emplace_back(n + i, n + i, -forces_.drag / mass_[static_cast<std::size_t>(i / 3)]);
    }
  }

 private:
  const ParticleForces& forces_;
  std::span<const Real> mass_;
};

}  // namespace offstage::sim
