#pragma once
/// The collisions of particles that collide with particles (physics P3-P8), of all systems together. They
/// have flown; then, as grains sorted by place, they are taken through their impacts (grain_impacts.h), and
/// what is left of the sub-step through resting contact (grain_contacts.h).

#include <span>
#include <vector>

#include "sim/dynamics/grain_contacts.h"
#include "sim/dynamics/grain_impacts.h"
#include "sim/dynamics/grain_search.h"
#include "sim/dynamics/particle_system.h"

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
    bool is_grain;  // its numbers are finite, and it is in no body
  };
  /// A particle of the step before, and its place among its grains.
  struct Known {
    ParticleSystemHandle system;
    uint64_t id;
    uint32_t place;
  };

  void gather(const ParticleStage& stage);
  Grain make_grain(const ParticleSystem& system, uint32_t number, std::size_t i, Real h) const;
  void sort();
  void match();
  void scatter(const ParticleStage& stage);

  std::span<ParticleSystem* const> systems_;
  std::vector<Outcome> outcomes_;
  std::vector<Source> sources_;
  std::vector<Grain> unsorted_, grains_;
  std::vector<Vec3> free_end_, end_, places_;
  std::vector<uint32_t> source_of_, members_, layer_, layer_begin_, before_;
  std::vector<uint8_t> touched_;
  std::vector<Known> known_;
  std::vector<GrainStrike> strikes_;
  std::vector<Reaction> reactions_;
  NeighborGrid order_;
  GrainSearch search_;
  GrainImpacts impacts_;
  GrainContacts contacts_;
};

}  // namespace offstage::sim
