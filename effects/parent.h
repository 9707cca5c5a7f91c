#pragma once
/// Private: the parents of particles.

#include <vector>

#include "effects/random.h"
#include "sim/world.h"

namespace offstage::effects {

/// State of a particle at some time.
struct Parent {
  uint64_t id = 0;
  Vec3 position, velocity;
  Real mass, radius, age, lifespan, restitution, friction, charge;
};

/// Returns the state of particle i at a time near the world's current time [s]. It is extrapolated to second
/// order with gravity and the system's own force and drag. Other forces are ignored; within a sub-step, their
/// effect on the position of a child is negligible.
Parent parent_at(const sim::World& world, sim::ParticleSystemHandle system, std::size_t i, Real time);

/// Finds the particles of a system that have been advanced for the first time. Before that, the creation time
/// of a new particle is unknown.
class NewParents {
 public:
  /// Returns the indices of the particles whose age has become greater than 0 since the last call, ascending.
  /// The first call omits older particles.
  const std::vector<std::size_t>& find(const sim::ParticleArrays& particles);

 private:
  bool begun_ = false;
  uint64_t next_ = 0;                   // first id that was not seen yet
  std::vector<uint64_t> age_zero_ids_;  // ids seen at age 0, ascending
  std::vector<uint64_t> waiting_;       // ids that had age 0 in the last call
  std::vector<std::size_t> found_;
};

}  // namespace offstage::effects
