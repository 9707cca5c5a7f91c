#pragma once
/// The collisions of particles that collide with particles (physics P3-P8), of all systems together. They
/// have flown; then, as particles sorted by place, they are taken through their impacts (particle_impacts.h),
/// and what is left of the sub-step through resting contact (particle_contacts.h).

#include <span>
#include <vector>

#include "sim/particles/particle_contacts.h"
#include "sim/particles/particle_impacts.h"
#include "sim/particles/particle_search.h"
#include "sim/particles/particle_system.h"

namespace offstage::sim {

class ParticleCollisions {
 public:
  /// What became of the particles of a system.
  struct Outcome {
    std::vector<uint8_t> touched, trapped;  ///< by particle
    ParticleTally tally;                    ///< of collisions alone
  };

  /// Moves the particles of systems that have flown (ParticleSystem::fly_all), given in the order of their
  /// handles, to the end of the sub-step.
  void step(std::span<ParticleSystem* const> systems, const ParticleStage& stage, ImpactLaw law,
            Real collision_speed);

  /// By system, of the last step.
  std::span<Outcome> outcomes() { return outcomes_; }

 private:
  struct Source {
    uint32_t system, index;
    bool is_particles;  // its numbers are finite, and it is in no body
  };
  /// A particle of the step before, and its place among its particles.
  struct Known {
    ParticleSystemHandle system;
    uint64_t id;
    uint32_t place;
  };

  void gather(const ParticleStage& stage);
  CollidingParticle make_particles(const ParticleSystem& system, uint32_t number, std::size_t i,
                                   Real h) const;
  void sort();
  void match();
  void scatter(const ParticleStage& stage);

  std::span<ParticleSystem* const> systems_;
  std::vector<Outcome> outcomes_;
  std::vector<Source> sources_;
  std::vector<CollidingParticle> unsorted_, particles_;
  std::vector<Vec3> free_end_, end_, places_;
  std::vector<uint32_t> source_of_, members_, layer_, layer_begin_, before_;
  std::vector<uint8_t> touched_;
  std::vector<Known> known_;
  std::vector<ParticleStrike> strikes_;
  std::vector<Reaction> reactions_;
  NeighborGrid order_;
  ParticleSearch search_;
  ParticleImpacts impacts_;
  ParticleContacts contacts_;
};

}  // namespace offstage::sim
