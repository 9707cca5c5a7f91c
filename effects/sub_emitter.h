#pragma once
/// Sub-emitters release particles at events of other particles: at a given age, at death or at a collision.
/// They are used for splashes, bursting shells and sparks.

#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/new_particles.h"
#include "effects/offspring.h"
#include "effects/parent.h"

namespace offstage::effects {

class Draws;

enum class Trigger {
  age,        ///< the parent reaches an age
  death,      ///< the parent's lifespan ends; its system must report deaths
  collision,  ///< the parent collides; its system must report collisions
};

/// Axis of the directions of new particles.
enum class Axis {
  normal,    ///< normal of the surface hit; without a collision, as `velocity`
  velocity,  ///< direction of the parent's velocity after the event; upwards for a parent at rest
};

/// The particles that an event releases.
struct EventRelease {
  Real probability = 1;  ///< probability that an event triggers particles, in [0, 1]
  /// Smallest speed of the parent after the event [m/s]; slower parents trigger nothing.
  Real min_speed = 0;
  Varying count = 5.0;  ///< particles per event, rounded
  Axis axis = Axis::normal;
  Varying velocity_percent =
      0.0;  ///< percentage of the parent's velocity after the event that new particles get
  uint64_t max_per_step = 10'000;  ///< greatest number of new particles in one sub-step; further ones are not
                                   ///< released, but counted
};

struct SubEmitterDef {
  std::string name = {};  ///< name of the sub-emitter, which also selects its random numbers
  uint64_t seed = 1;
  Trigger trigger = Trigger::collision;
  Real age = 1;  ///< age for the trigger `age` [s], >= 0
  EventRelease release = {};
  /// Parameters of the new particles. Their own velocity is along a random direction around the axis; the
  /// percentage of the parent's velocity is added to it.
  NewParticles particles = {.spread_deg = 30.0, .radius = 0.005, .lifespan = 1.0};
};

/// Releases particles of one system at the events of particles of another system, or of the same one. Random
/// numbers depend on the parent's id and the time of the event.
class SubEmitter {
 public:
  /// Throws std::invalid_argument if a parameter is out of range.
  SubEmitter(const SubEmitterDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle target);

  /// Adds the particles for the events of the last sub-step, and for the ages reached in (start, end]. Call
  /// it before each sub-step.
  void emit(sim::World& world, Real start, Real end);

  const OffspringReport& report() const { return report_; }
  const SubEmitterDef& def() const { return def_; }

 private:
  void answer_events(sim::World& world, Real start, Real end);
  void answer_ages(sim::World& world, Real start, Real end);
  void answer(sim::World& world, const sim::ParticleEvent& event, Real start, Real end);
  sim::Particle answer_to(const sim::ParticleEvent& event, const Draws& draw) const;

  SubEmitterDef def_;
  sim::ParticleSystemHandle parents_, target_;
  RandomStream random_;
  NewParents new_parents_;
  OffspringReport report_;
  uint64_t born_ = 0;  // number of particles released in this sub-step
};

}  // namespace offstage::effects
