#pragma once
/// Trails: particles that moving particles leave behind, like the stars of a firework.

#include <string>
#include <vector>

#include "effects/distribution.h"
#include "effects/new_particles.h"
#include "effects/offspring.h"
#include "effects/parent.h"

namespace offstage::effects {

class Draws;

/// The times at which parents leave particles of a trail.
struct TrailRelease {
  Varying rate = 60.0;  ///< particles per second of each parent, drawn once for its life; must not be a curve
  Real start_age = 0;   ///< age of the parent at which its trail begins [s], >= 0
  Real end_age = 1e30;  ///< age of the parent at which its trail ends [s]
  Varying velocity_percent = 0.0;  ///< percentage of the parent's velocity that new particles get
};

struct TrailDef {
  std::string name = {};  ///< name of the trail, which also selects its random numbers
  uint64_t seed = 1;
  TrailRelease release = {};
  /// Parameters of the new particles. Their own velocity is opposite to the parent's velocity; the percentage
  /// of the parent's velocity is added to it.
  NewParticles particles = {.speed = 0.0, .radius = 0.005, .lifespan = 1.0};
};

/// Creates the trails of all particles of a system (the parents). Each parent releases particles at regular
/// times from its position at that time, so that trails are even at any speed. Random numbers depend on the
/// parent's id and the number of the particle in its trail.
class Trail {
 public:
  /// Throws std::invalid_argument if a parameter is out of range, or if both systems are the same.
  Trail(const TrailDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle target);

  /// Adds the particles left behind in (start, end]. Call it before each sub-step.
  void emit(sim::World& world, Real start, Real end);

  const OffspringReport& report() const { return report_; }
  const TrailDef& def() const { return def_; }

 private:
  void leave(sim::World& world, std::size_t i, bool is_new, Real start, Real end);
  sim::Particle left_by(const Parent& parent, const Draws& draw) const;

  TrailDef def_;
  sim::ParticleSystemHandle parents_, target_;
  RandomStream random_;
  NewParents new_parents_;
  OffspringReport report_;
};

}  // namespace offstage::effects
