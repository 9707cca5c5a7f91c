#pragma once
/// Private: particles that others are born from.

#include <vector>

#include "effects/random.h"
#include "sim/world.h"

namespace offstage::effects {

/// A particle at some time.
struct Parent {
  uint64_t id = 0;
  Vec3 position, velocity;
  Real mass, radius, age, lifespan, restitution, friction, charge;
};

/// Particle i at a time near the world's: moved on by gravity, the system's own force and its drag, to second
/// order. What else acts on it within a sub-step is too little to be seen where a child is born.
Parent parent_at(const sim::World& world, sim::ParticleSystemHandle system, std::size_t i, Real time);

/// Tells which particles of a system have lived for the first time. A newborn does not show when it was born
/// before it has been stepped.
class Newcomers {
 public:
  /// Places in the arrays, ascending, of those that have become older than 0 since the last call. The first
  /// call leaves out those that are older already.
  const std::vector<std::size_t>& find(const sim::ParticleArrays& particles);

 private:
  bool begun_ = false;
  uint64_t next_ = 0;              // the first id never seen
  std::vector<uint64_t> unborn_;   // ids seen at age 0, ascending
  std::vector<uint64_t> waiting_;  // of the last call
  std::vector<std::size_t> found_;
};

}  // namespace offstage::effects
