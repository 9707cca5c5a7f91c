#include "effects/parent.h"

#include <algorithm>

namespace offstage::effects {

Parent parent_at(const sim::World& world, sim::ParticleSystemHandle system, std::size_t i, Real time) {
  const sim::ParticleArrays& p = world.particles(system);
  const sim::ParticleSystemDef& def = world.particle_system_def(system);
  const sim::WorldDef& around = world.def();
  const Real dt = time - world.time();
  const Vec3 &x = p.position[i], &v = p.velocity[i];
  Vec3 a = (def.force - def.linear_drag * (v - around.wind)) / p.mass[i];
  if (def.gravity) a += around.gravity;
  return {p.id[i],       x + dt * v + dt * dt / 2 * a,
          v + dt * a,    p.mass[i],
          p.radius[i],   p.age[i] + dt,
          p.lifespan[i], p.restitution[i],
          p.friction[i], p.charge[i]};
}

const std::vector<std::size_t>& NewParents::find(const sim::ParticleArrays& particles) {
  found_.clear();
  waiting_.swap(age_zero_ids_);
  age_zero_ids_.clear();
  const uint64_t oldest = waiting_.empty() ? next_ : std::min(next_, waiting_.front());
  const auto first = std::lower_bound(particles.id.begin(), particles.id.end(), oldest);
  auto known = waiting_.begin();
  for (auto i = static_cast<std::size_t>(first - particles.id.begin()); i < particles.size(); ++i) {
    const uint64_t id = particles.id[i];
    while (known != waiting_.end() && *known < id) ++known;
    const bool is_new = id >= next_ || (known != waiting_.end() && *known == id);
    if (!is_new) continue;
    if (particles.age[i] == 0)
      age_zero_ids_.push_back(id);
    else if (begun_)
      found_.push_back(i);
  }
  if (particles.size() > 0) next_ = std::max(next_, particles.id.back() + 1);
  begun_ = true;
  return found_;
}

}  // namespace offstage::effects
