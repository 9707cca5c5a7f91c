#include "effects/particle_draws.h"

namespace offstage::effects {

uint64_t rounded(Real x) {
  return static_cast<uint64_t>(std::floor(std::clamp(x, 0.0, 1e9) + 0.5));
}

bool add_new_particle(sim::World& world, sim::ParticleSystemHandle system, sim::Particle particle,
                      Real birth_time, Real start, Real end) {
  const Real late = start - birth_time;
  if (late > 0) {
    particle.position += late * particle.velocity;
    particle.lifespan -= late;
    if (!(particle.lifespan > 0)) return false;
  }
  world.add_particle(system, particle, end - std::max(birth_time, start));
  return true;
}

}  // namespace offstage::effects
