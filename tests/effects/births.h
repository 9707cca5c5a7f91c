#pragma once
/// Reconstructs when and where emitters created particles, from the particles at the end of a simulation.

#include <vector>

#include "effects/emitter.h"

namespace offstage::effects {

/// The state of a particle at its creation, computed on the assumption that no force acted on it afterwards.
struct Birth {
  Real time;
  Vec3 position, velocity;
  Real radius;
};

inline std::vector<Birth> births_of(const sim::World& world, sim::ParticleSystemHandle system) {
  const sim::ParticleArrays& p = world.particles(system);
  std::vector<Birth> births;
  for (std::size_t i = 0; i < p.size(); ++i)
    births.push_back(
        {world.time() - p.age[i], p.position[i] - p.age[i] * p.velocity[i], p.velocity[i], p.radius[i]});
  return births;
}

/// Returns a world without gravity and other forces.
inline sim::World empty_world(Real max_step = 1.0 / 240) {
  return sim::World({.gravity = Vec3::Zero(),
                     .max_step = max_step,
                     .bounds = sim::Aabb(Vec3::Constant(-1e6), Vec3::Constant(1e6))});
}

/// Steps a world for `seconds`, calling emit() of all `sources` in turn in each sub-step.
template <class... Sources>
void run(sim::World& world, Real seconds, int fps, Sources&... sources) {
  const int frames = static_cast<int>(seconds * fps + 0.5);
  for (int i = 0; i < frames; ++i)
    world.step(1.0 / fps, [&](Real start, Real end) { (sources.emit(world, start, end), ...); });
}

}  // namespace offstage::effects
