#include "effects/split.h"

#include <algorithm>
#include <cmath>

#include "effects/emitter_surface.h"
#include "effects/limits.h"
#include "effects/particle_draws.h"

namespace offstage::effects {
namespace {

/// A particle at rest has no direction; its children get this direction, and no speed.
const Vec3 kNoDirection = Vec3::UnitY();

const SplitDef& checked_split(const SplitDef& def) {
  const auto verify = [&](const char* field, const Varying& v, const Limits& limits) {
    check("split \"" + def.name + "\"", field, v, limits);
  };
  verify("count", def.count, kCounts);
  verify("age", def.age, kPositive);
  verify("delay", def.delay, kIntervals);
  verify("velocity_percent", def.velocity_percent, kAnyNumber);
  verify("spread_deg", def.spread_deg, kAngle);
  verify("radius_percent", def.radius_percent, kPositive);
  verify("mass_percent", def.mass_percent, kNotNegative);
  verify("lifespan_percent", def.lifespan_percent, kPositive);
  if (def.depth < 0) throw std::invalid_argument("split \"" + def.name + "\": depth must be >= 0");
  return def;
}

}  // namespace

Splitter::Splitter(const SplitDef& def, sim::ParticleSystemHandle parents, sim::ParticleSystemHandle children)
    : def_(checked_split(def)),
      parents_(parents),
      children_(children),
      random_(def.seed, stream_id(def.name)) {}

void Splitter::emit(sim::World& world, Real start, Real end) {
  if (!def_.enabled || def_.depth == 0) return;
  enter_new_particles(world, start);
  while (!due_.empty() && due_.top().time <= end) {
    const Due due = due_.top();
    due_.pop();
    split(world, due, start, end);
  }
}

/// Assigns numbers to the new particles that are not children, in the order of creation. Children that were
/// created between them do not affect these numbers.
void Splitter::enter_new_particles(const sim::World& world, Real now) {
  const sim::ParticleArrays& p = world.particles(parents_);
  for (std::size_t i : new_parents_.find(p)) {
    const auto own = std::lower_bound(own_children_.begin(), own_children_.end(), p.id[i]);
    if (own != own_children_.end() && *own == p.id[i]) continue;
    const auto before = static_cast<uint64_t>(own - own_children_.begin());
    enter(p.id[i], combined(p.id[i] - before, 0), now - p.age[i], def_.depth);
  }
}

void Splitter::enter(uint64_t id, uint64_t line, Real birth_time, int left) {
  if (left > 0) due_.push({birth_time + Draws(random_, line, birth_time)(def_.age, kAge), id, line, left, 0});
}

void Splitter::split(sim::World& world, const Due& due, Real start, Real end) {
  const sim::ParticleArrays& p = world.particles(parents_);
  const auto found = std::lower_bound(p.id.begin(), p.id.end(), due.id);
  if (found == p.id.end() || *found != due.id) return;
  const Parent parent = parent_at(world, parents_, static_cast<std::size_t>(found - p.id.begin()), due.time);
  if (parent.age >= parent.lifespan) return;

  const uint64_t this_split = combined(due.line, static_cast<uint64_t>(due.done) + 1);
  const Draws draw(random_, this_split, due.time);
  const uint64_t count = rounded(draw(def_.count, kCount)), alive = world.particles(children_).size();
  const uint64_t allowed = std::min(count, def_.max_alive > alive ? def_.max_alive - alive : 0);
  for (uint64_t k = 0; k < allowed; ++k) {
    const uint64_t line = combined(this_split, k + 1);
    const sim::Particle child = child_of(parent, Draws(random_, line, due.time));
    if (!add_new_particle(world, children_, child, due.time, start, end)) continue;
    ++report_.released;
    if (children_ != parents_) continue;
    own_children_.push_back(world.particles(children_).id.back());
    enter(own_children_.back(), line, due.time, due.left - 1);
  }
  report_.skipped += count - allowed;
  ++report_.triggered;
  if (due.left > 1)
    due_.push({due.time + draw(def_.delay, kDelay), due.id, due.line, due.left - 1, due.done + 1});
}

sim::Particle Splitter::child_of(const Parent& parent, const Draws& draw) const {
  const auto part = [&](const Varying& percent, uint32_t property) { return draw(percent, property) / 100; };
  const Real size = part(def_.radius_percent, kRadius), mass = part(def_.mass_percent, kMass);
  const Real fraction = mass > 0 ? mass : size * size * size;
  const Real speed = parent.velocity.norm();
  const Vec3 axis = speed > 0 ? Vec3(parent.velocity / speed) : kNoDirection;
  const Vec3 direction = Cone{axis, perpendicular(axis)}.drawn(def_.spread_deg, draw);
  return {.position = parent.position,
          .velocity = part(def_.velocity_percent, kPercent) * speed * direction,
          .mass = fraction * parent.mass,
          .radius = size * parent.radius,
          .lifespan = part(def_.lifespan_percent, kLifespan) * parent.lifespan,
          .restitution = parent.restitution,
          .friction = parent.friction,
          .charge = fraction * parent.charge};
}

}  // namespace offstage::effects
