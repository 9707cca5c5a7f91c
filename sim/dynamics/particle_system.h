#pragma once
/// A particle system at work: its arrays, the newborns of the coming sub-step, and the stages of a sub-step.
/// Particles do not see each other, so a stage runs over chunks in parallel and its results do not depend on
/// the chunks.

#include <optional>
#include <vector>

#include "sim/collision/obstacles.h"
#include "sim/dynamics/particle_forces.h"
#include "sim/dynamics/particle_sweep.h"
#include "sim/world.h"

namespace offstage::sim {

/// What became of a system's particles in a sub-step.
struct ParticleTally {
  uint64_t expired = 0, retired = 0, ejected = 0, removed = 0, collisions = 0, truncated = 0;
  std::optional<NonFinite>
      lost;  ///< the first particle that stopped being finite; `object` is left to the world

  ParticleTally& operator+=(const ParticleTally& t);
};

/// A sub-step as all particle systems see it.
struct ParticleStage {
  Real time, h;
  const Obstacles& fixed;
  const Obstacles& moving;
  const Aabb& bounds;
};

struct ParticleSystem {
  ParticleSystemDef def;
  ParticleArrays arrays;
  uint64_t next_id = 0;
  /// For the last particles of the arrays, those added since the last sub-step: how long before its end each
  /// was born; negative: it was there from its start.
  std::vector<Real> newborn;

  uint64_t add(const Particle& p, Real elapsed);
  /// Place of a particle in the arrays; empty if it is no more.
  std::optional<std::size_t> find(uint64_t id) const;

  /// Whether a particle lives through the whole coming sub-step.
  bool whole_step(std::size_t i) const {
    const std::size_t old = arrays.size() - newborn.size();
    return i < old || newborn[i - old] < 0;
  }

  /// Keeps the state at the start of the sub-step, for those that integrate the whole system themselves.
  void begin_coupled();
  /// Integrates, sweeps against bodies, ages and removes. Of a `coupled` system the particles of whole_step()
  /// are already integrated.
  ParticleTally step(const ParticleStage& stage, const ParticleForces& forces, bool coupled);

 private:
  enum class Fate : uint8_t { alive, dead };
  struct Scratch;

  void fly(const ParticleForces& forces, Real t, Real h, std::size_t begin, std::size_t end,
           Scratch& scratch);
  void settle(const ParticleStage& stage, const ParticleForces& forces, ParticleSweep& sweep, std::size_t i,
              const Vec3& x0, const Vec3& v0, Real duration, bool coupled, ParticleTally& tally);
  void remove_dead();

  std::vector<Vec3> start_position_, start_velocity_;  // of a coupled system
  std::vector<Fate> fate_;
};

}  // namespace offstage::sim
