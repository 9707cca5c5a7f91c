#include "effects/sub_emitter.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "effects/emitter_surface.h"
#include "effects/limits.h"
#include "effects/particle_draws.h"

namespace offstage::effects {
namespace {

const SubEmitterDef& checked_sub_emitter(const SubEmitterDef& def) {
  const std::string owner = "sub-emitter \"" + def.name + "\"";
  check(owner, "count", def.release.count, kCounts);
  check(owner, "velocity_percent", def.release.velocity_percent, kAnyNumber);
  check_particles(owner, def.particles);
  if (!(def.age >= 0)) throw std::invalid_argument(owner + ": age must be >= 0");
  if (!(def.release.probability >= 0 && def.release.probability <= 1))
    throw std::invalid_argument(owner + ": probability is outside 0 to 1");
  return def;
}

}  // namespace

SubEmitter::SubEmitter(const SubEmitterDef& def, sim::ParticleSystemHandle parents,
                       sim::ParticleSystemHandle target)
    : def_(checked_sub_emitter(def)),
      parents_(parents),
      target_(target),
      random_(def.seed, stream_id(def.name)) {}

void SubEmitter::emit(sim::World& world, Real start, Real end) {
  born_ = 0;
  if (def_.trigger == Trigger::age)
    answer_ages(world, start, end);
  else
    answer_events(world, start, end);
}

void SubEmitter::answer_events(sim::World& world, Real start, Real end) {
  using Kind = sim::ParticleEvent::Kind;
  const Kind kind = def_.trigger == Trigger::death ? Kind::death : Kind::collision;
  for (const sim::ParticleEvent& event : world.particle_events())
    if (event.kind == kind && event.system == parents_) answer(world, event, start, end);
}

void SubEmitter::answer_ages(sim::World& world, Real start, Real end) {
  // Particles that are added to the parents' own system are appended after the existing ones.
  const std::size_t count = world.particles(parents_).size();
  const std::vector<std::size_t>& fresh = new_parents_.find(world.particles(parents_));
  auto next = fresh.begin();
  for (std::size_t i = 0; i < count; ++i) {
    const sim::ParticleArrays& p = world.particles(parents_);
    const bool is_new = next != fresh.end() && *next == i;
    next += is_new;
    const Real age = p.age[i];
    const bool reached = age > 0 && (age < def_.age || is_new) && def_.age <= age + (end - start);
    if (!reached || def_.age >= p.lifespan[i]) continue;
    const Real time = start + (def_.age - age);
    const Parent parent = parent_at(world, parents_, i, time);
    answer(world,
           {.system = parents_,
            .id = parent.id,
            .time = time,
            .position = parent.position,
            .velocity = parent.velocity,
            .mass = parent.mass,
            .radius = parent.radius,
            .age = parent.age},
           start, end);
  }
}

void SubEmitter::answer(sim::World& world, const sim::ParticleEvent& event, Real start, Real end) {
  if (event.velocity.norm() < def_.release.min_speed) return;
  // For the trigger `age`, the time of the event is not used: an age is reached only once, and the rounding
  // of the time depends on the frame rate.
  const uint64_t occasion = def_.trigger == Trigger::age ? 0 : std::bit_cast<uint64_t>(event.time);
  const uint64_t index = combined(event.id, occasion);
  const Draws draw(random_, index, event.time);
  if (draw.uniform(kChance) > def_.release.probability) return;

  const uint64_t count = rounded(draw(def_.release.count, kCount)), alive = world.particles(target_).size();
  const uint64_t allowed =
      std::min({count, def_.particles.max_alive > alive ? def_.particles.max_alive - alive : 0,
                def_.release.max_per_step - std::min(born_, def_.release.max_per_step)});
  for (uint64_t k = 0; k < allowed; ++k) {
    const Draws own(random_, combined(index, k + 1), event.time);
    report_.released += add_new_particle(world, target_, answer_to(event, own), event.time, start, end);
  }
  born_ += allowed;
  report_.skipped += count - allowed;
  ++report_.triggered;
}

sim::Particle SubEmitter::answer_to(const sim::ParticleEvent& event, const Draws& draw) const {
  sim::Particle particle = drawn_particle(def_.particles, draw);
  const bool hit = !event.normal.isZero(0);
  const Real speed = event.velocity.norm();
  const Vec3 axis = hit && def_.release.axis == Axis::normal ? event.normal
                    : speed > 0                              ? Vec3(event.velocity / speed)
                                                             : Vec3(Vec3::UnitY());
  // The particle touches the surface that its parent touched.
  particle.position = event.position + (particle.radius - event.radius) * event.normal;
  particle.velocity = draw(def_.release.velocity_percent, kPercent) / 100 * event.velocity +
                      draw(def_.particles.speed, kSpeed) *
                          Cone{axis, perpendicular(axis)}.drawn(def_.particles.spread_deg, draw);
  return particle;
}

}  // namespace offstage::effects
