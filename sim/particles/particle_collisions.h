#pragma once
/// Collisions of particles with particles (physics P3-P8), for all systems together. After free flight the
/// particles are sorted by position. Then impacts are resolved (particle_impacts.h), and finally resting
/// contact for the rest of the sub-step (particle_contacts.h).

#include <span>
#include <vector>

#include "sim/particles/particle_contacts.h"
#include "sim/particles/particle_impacts.h"
#include "sim/particles/particle_search.h"
#include "sim/particles/particle_system.h"

namespace offstage::sim {

class ParticleCollisions {
 public:
  /// Results for the particles of a system.
  struct Outcome {
    /// For each particle: whether it touched anything, and whether it is trapped in a body.
    std::vector<uint8_t> touched, trapped;
    ParticleTally tally;  ///< figures of the system; only those about collisions are set
  };

  /// Moves particles to the end of the sub-step and resolves their collisions: all particles of systems that
  /// collide with particles, and those on bodies of other systems. ParticleSystem::fly_all() must have been
  /// called for each system. The systems must be in the order of their handles. `lcp_cluster`: see
  /// ParticleContacts::solve().
  void step(std::span<ParticleSystem* const> systems, const ParticleStage& stage, ImpactLaw law,
            Real collision_speed, uint32_t lcp_cluster = 0);

  /// Forgets the contacts of the last sub-step. Call it in a sub-step without step().
  void forget() { known_.clear(); }

  /// Work of pivoting on contacts in the last step.
  const ContactWork& lcp_work() const { return contacts_.lcp_work(); }

  /// Results of the last step by system.
  std::span<Outcome> outcomes() { return outcomes_; }

 private:
  struct Source {
    uint32_t system, index;
    bool is_particles;  // whether it takes part: its numbers are finite, and it is not inside a body
  };
  /// A particle of the previous step, with its index there.
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
  std::vector<Known> known_;  // the particles of the last sub-step
  std::vector<ParticleStrike> strikes_;
  std::vector<Reaction> reactions_;
  NeighborGrid order_;
  ParticleSearch search_;
  ParticleImpacts impacts_;
  ParticleContacts contacts_;
};

}  // namespace offstage::sim
