#pragma once
/// Internal state of a particle system: its arrays, the new particles of the next sub-step, and the stages of
/// a sub-step. The stages run over chunks in parallel, and their results do not depend on the chunks.
/// Particles that collide with particles have three stages: fly_all(), their common collisions
/// (particle_collisions.h), and end_step().

#include <optional>
#include <span>
#include <vector>

#include "sim/collision/obstacles.h"
#include "sim/core/non_finite.h"
#include "sim/particles/particle_forces.h"
#include "sim/particles/particle_sweep.h"

namespace offstage::sim {

/// Results for a system's particles in a sub-step.
struct ParticleTally : ParticleFigures {
  /// The first particle whose state became infinite or NaN; the world sets `object`.
  std::optional<NonFinite> lost;
  std::vector<ParticleEvent> events;  ///< events of particles; empty unless the system reports them

  ParticleTally& operator+=(const ParticleTally& t);
};

/// Parameters of a sub-step for all particle systems.
struct ParticleStage {
  Real time, h;
  const Obstacles& fixed;
  Obstacles& moving;
  const Aabb& bounds;
  BodyImpulses& impulses;  ///< impulses on dynamic bodies
  ClothObstacles& cloths;
};

struct ParticleSystem {
  ParticleSystemHandle handle;
  ParticleSystemDef def;
  ParticleArrays arrays;
  uint64_t next_id = 0;
  /// For each particle added since the last sub-step (the last ones of the arrays): time from its birth to
  /// the end of the coming sub-step [s]. A negative value means that it exists from the sub-step's start.
  std::vector<Real> since_birth;

  uint64_t add(const Particle& p, Real elapsed);
  /// Index of a particle in the arrays; empty if it does not exist any more.
  std::optional<std::size_t> find(uint64_t id) const;

  /// Whether particle i exists during the whole coming sub-step.
  bool whole_step(std::size_t i) const {
    const std::size_t old = arrays.size() - since_birth.size();
    return i < old || since_birth[i - old] < 0;
  }

  /// Moves the particles that were added since the last sub-step along their free flight up to now. From now
  /// on they exist during whole sub-steps.
  void admit_new_particles(const ParticleForces& forces);
  /// Stores the state at the start of the sub-step, for a CoupledGroup that integrates the system.
  void begin_coupled();
  /// Whether ParticleCollisions resolves the collisions of this system.
  bool hits_particles() const { return def.internal || def.external || def.rotates; }
  /// Whether particles of a system that does not collide with particles may rest on bodies.
  bool may_rest() const { return !hits_particles() && def.collides && !def.dies_on_hit; }
  /// Box around the paths of the particles in the next sub-step of length h [s], if no force changes a
  /// velocity by more than itself plus 2 h `gravity`.
  Aabb reach(Real h, const Vec3& gravity) const;
  /// For a system that may_rest(), after fly_all(): finds the particles that may touch dynamic bodies in this
  /// sub-step. ParticleCollisions resolves their collisions, too, because particles that rest on a body and
  /// the body determine each other's motion.
  void find_on_bodies(const ParticleStage& stage);
  std::span<const uint32_t> on_bodies() const { return on_bodies_; }
  /// Advances a system whose particles do not collide with particles: integrates them unless fly_all() has
  /// done so, sweeps them against bodies, and removes those whose life has ended. `coupled`: the particles
  /// for which whole_step() is true have been integrated already. `trapped`:
  /// ParticleCollisions::Outcome::trapped for those on_bodies().
  ParticleTally step(const ParticleStage& stage, const ParticleForces& forces, bool coupled,
                     std::span<const uint8_t> trapped = {});

  /// For a system whose particles collide with particles or may rest on bodies: integrates without
  /// collisions, and stores the initial states for flight().
  void fly_all(const ParticleStage& stage, const ParticleForces& forces, bool coupled);
  /// A particle's flight: initial state and duration.
  struct Flight {
    Vec3 position, velocity;
    Real duration;
  };
  Flight flight(std::size_t i) const { return {start_position_[i], start_velocity_[i], duration_[i]}; }
  /// After the collisions with particles, stops particles that would pass cloth on their way from flight() to
  /// their new positions, and sets `touched` for those that touch cloth.
  void meet_cloths(const ParticleStage& stage, const ParticleForces& forces, std::span<uint8_t> touched,
                   ParticleTally& tally);
  /// Increases the age of the particles and removes those whose life has ended. `touched` and `trapped`: see
  /// ParticleCollisions::Outcome.
  ParticleTally end_step(const ParticleStage& stage, std::span<const uint8_t> touched,
                         std::span<const uint8_t> trapped);
  ParticleEvent collision_event(const ParticleStage& stage, std::size_t i, const Strike& strike) const;

 private:
  enum class Fate : uint8_t { alive, dead };
  struct Scratch;

  template <class MakeLanding>
  void fly_each(const ParticleStage& stage, const ParticleForces& forces, bool coupled,
                MakeLanding&& make_landing);
  template <class MakeLanding>
  void land_flown(bool coupled, MakeLanding&& make_landing);
  bool is_lost(std::size_t i, const Flight& flight, ParticleTally& tally) const;
  struct Striker;
  void strike_bodies(const ParticleStage& stage, const ParticleForces& forces, std::vector<Striker> strikers,
                     ParticleTally& tally);
  void finish_sweep(const ParticleStage& stage, std::size_t i, const SweepOutcome& outcome, SweepLog& log,
                    ParticleTally& tally);
  void end(const ParticleStage& stage, std::size_t i, bool spent, bool trapped, ParticleTally& tally);
  void turn(std::size_t i);
  bool meet_cloths(const ParticleStage& stage, const ParticleForces& forces, std::size_t i,
                   ParticleTally& tally);
  ParticleTally sum_up(std::span<const ParticleTally> tallies);

  void fly(const ParticleForces& forces, Real t, Real h, std::size_t begin, std::size_t end,
           Scratch& scratch);
  void fly_before(const ParticleForces& forces, Real t, std::size_t i, Real duration, Scratch& scratch);
  SweepOutcome sweep(const ParticleStage& stage, const ParticleForces& forces, ParticleSweep& sweep,
                     std::size_t i, const Flight& flight, bool integrated);
  void remove_dead();

  std::vector<Vec3> start_position_, start_velocity_;  // for a coupled system, or after fly_all()
  std::vector<Real> duration_;                         // after fly_all()
  bool has_flown_ = false;                             // whether fly_all() was called in this sub-step
  std::vector<uint32_t> on_bodies_;                    // ascending
  std::vector<uint8_t> is_on_body_;                    // by particle; empty if none is
  std::vector<Fate> fate_;
};

}  // namespace offstage::sim
