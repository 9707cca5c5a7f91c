#include "effects/newborn.h"

namespace offstage::effects {

uint64_t rounded(Real x) {
  return static_cast<uint64_t>(std::floor(std::clamp(x, 0.0, 1e9) + 0.5));
}

bool add_newborn(sim::World& world, sim::ParticleSystemHandle system, sim::Particle particle, Real birth,
                 Real start, Real end) {
  const Real late = start - birth;
  if (late > 0) {
    particle.position += late * particle.velocity;
    particle.lifespan -= late;
    if (!(particle.lifespan > 0)) return false;
  }
  world.add_particle(system, particle, end - std::max(birth, start));
  return true;
}

}  // namespace offstage::effects
