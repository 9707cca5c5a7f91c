#include "effects/neighbours.h"

#include <algorithm>

namespace offstage::effects {

bool Neighbours::exist(const sim::World& world, sim::ParticleSystemHandle system) {
  const sim::ParticleSystemDef& def = world.particle_system_def(system);
  return def.internal || def.external;
}

void Neighbours::collect(const sim::World& world, sim::ParticleSystemHandle system, const Vec3& centre,
                         Real radius, Real start, Real end) {
  start_ = start;
  balls_.clear();
  const sim::ParticleSystemDef& def = world.particle_system_def(system);
  world.for_each_particle_system([&](sim::ParticleSystemHandle other) {
    const bool meet =
        other == system ? def.internal : def.external && world.particle_system_def(other).external;
    if (meet) collect_from(world.particles(other), centre, radius, end - start);
  });
}

void Neighbours::collect_from(const sim::ParticleArrays& particles, const Vec3& centre, Real radius,
                              Real duration) {
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Real reach = radius + particles.radius[i] + particles.velocity[i].norm() * duration;
    if ((particles.position[i] - centre).squaredNorm() < reach * reach)
      balls_.push_back({particles.position[i], particles.velocity[i], particles.radius[i]});
  }
}

void Neighbours::add(const sim::Particle& particle, Real birth_time) {
  balls_.push_back(
      {particle.position - (birth_time - start_) * particle.velocity, particle.velocity, particle.radius});
}

void Neighbours::place_into(Spacing& spacing, uint64_t count, Real diameter, Real time,
                            const sim::Pose& carrier, const sim::Pose& surface) const {
  for (const Ball& ball : balls_) diameter = std::max(diameter, 2 * ball.radius);
  spacing.reset(balls_.size() + count, diameter);
  for (const Ball& ball : balls_) {
    const Vec3 place = ball.position + (time - start_) * ball.velocity;
    spacing.insert(surface.point_to_body(carrier.point_to_body(place)), ball.radius);
  }
}

}  // namespace offstage::effects
