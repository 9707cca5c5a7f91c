#include "effects/trail.h"

#include <algorithm>
#include <cmath>

#include "effects/emitter_surface.h"
#include "effects/limits.h"
#include "effects/particle_draws.h"

namespace offstage::effects {
namespace {

const TrailDef& checked_trail(const TrailDef& def) {
  const std::string owner = "trail \"" + def.name + "\"";
  check(owner, "rate", def.release.rate, kRates);
  check(owner, "velocity_percent", def.release.velocity_percent, kAnyNumber);
  check_particles(owner, def.particles);
  if (std::holds_alternative<Curve>(def.release.rate))
    throw std::invalid_argument(owner + ": rate must not be a curve");
  if (!(def.release.start_age >= 0)) throw std::invalid_argument(owner + ": start_age must be >= 0");
  return def;
}

}  // namespace

Trail::Trail(const TrailDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle target)
    : def_(checked_trail(def)), parents_(parents), target_(target), random_(def.seed, stream_id(def.name)) {
  if (parents && parents == target)
    throw std::invalid_argument("trail \"" + def.name + "\": a trail of trails would never end");
}

void Trail::emit(sim::World& world, Real start, Real end) {
  const sim::ParticleArrays& p = world.particles(parents_);
  const std::vector<std::size_t>& fresh = new_parents_.find(p);
  auto next = fresh.begin();
  for (std::size_t i = 0; i < p.size(); ++i) {
    const bool is_new = next != fresh.end() && *next == i;
    next += is_new;
    // The creation time of a new particle is known only after it has been stepped. Its trail then starts at
    // that time.
    if (p.age[i] > 0) leave(world, i, is_new, start, end);
  }
}

/// Adds the particles that particle i leaves behind in the sub-step or, if it is new, since its creation.
void Trail::leave(sim::World& world, std::size_t i, bool is_new, Real start, Real end) {
  const sim::ParticleArrays& p = world.particles(parents_);
  const Draws draw(random_, p.id[i], start);
  const Real rate = std::min(kMaxRate, draw(def_.release.rate, kRate)), phase = draw.uniform(kChance);
  if (!(rate > 0)) return;
  const Real age = p.age[i], last_age = std::min(def_.release.end_age, p.lifespan[i]);
  // Particle k is created at the age start_age + (k + phase) / rate.
  const auto left_by_age = [&](Real a) {
    return static_cast<uint64_t>(
        std::max(0.0, std::floor((std::min(a, last_age) - def_.release.start_age) * rate - phase) + 1));
  };
  const uint64_t first = is_new ? 0 : left_by_age(age), last = left_by_age(age + (end - start));
  for (uint64_t k = first; k < last; ++k) {
    if (world.particles(target_).size() >= def_.particles.max_alive) {
      report_.skipped += last - k;
      return;
    }
    const Real time = start + (def_.release.start_age + (static_cast<Real>(k) + phase) / rate - age);
    const Draws own(random_, combined(p.id[i], k + 1), time);
    report_.released +=
        add_new_particle(world, target_, left_by(parent_at(world, parents_, i, time), own), time, start, end);
  }
}

sim::Particle Trail::left_by(const Parent& parent, const Draws& draw) const {
  sim::Particle particle = drawn_particle(def_.particles, draw);
  const Real speed = parent.velocity.norm();
  const Vec3 backwards = speed > 0 ? Vec3(-parent.velocity / speed) : Vec3(Vec3::UnitY());
  particle.position = parent.position;
  particle.velocity = draw(def_.release.velocity_percent, kPercent) / 100 * parent.velocity +
                      draw(def_.particles.speed, kSpeed) *
                          Cone{backwards, perpendicular(backwards)}.drawn(def_.particles.spread_deg, draw);
  return particle;
}

}  // namespace offstage::effects
