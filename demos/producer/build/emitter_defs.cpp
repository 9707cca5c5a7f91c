#include "producer/build/emitter_defs.h"

#include <algorithm>
#include <limits>
#include <map>

#include "sim/core/rotation.h"

namespace offstage::producer {
namespace {

effects::EmitterSurface surface_of(const PlaneSurface& s) {
  return {.kind = effects::SurfaceKind::plane, .pose = {s.position, s.orientation()}, .size = s.size};
}
effects::EmitterSurface surface_of(const SphereSurface& s) {
  return {.kind = effects::SurfaceKind::sphere, .pose = {s.position, Quat::Identity()}, .radius = s.radius};
}
effects::EmitterSurface surface_of(const DiscSurface& s) {
  return {.kind = effects::SurfaceKind::disc,
          .pose = {s.position, sim::rotation_between(Vec3::UnitY(), s.direction)},
          .radius = s.radius};
}
/// Returns a placeholder for a face that could not be resolved. The scene has an error in this case, so the
/// placeholder is never used.
effects::EmitterSurface surface_of(const FaceSurface& s) {
  return {.kind = effects::SurfaceKind::plane, .pose = {s.position, Quat::Identity()}, .size = {1, 1}};
}
effects::EmitterSurface surface_of(const MeshSurface& s) {
  return {.kind = effects::SurfaceKind::mesh, .pose = {s.position, s.orientation}, .mesh = {}};
}

// --- Bounds ---

/// Gives an unclipped normal distribution bounds that are far from its mean.
void bound(Varying& v) {
  constexpr Real kDeviations = 4;
  auto* normal = std::get_if<effects::Normal>(&v);
  if (!normal || normal->clip) return;
  normal->min = std::max(normal->min, normal->mean - kDeviations * normal->deviation);
  normal->max = std::min(normal->max, normal->mean + kDeviations * normal->deviation);
}
constexpr uint64_t kNoLimit = std::numeric_limits<uint64_t>::max();

/// Returns the estimated number of collisions of a particle in its life.
Real expected_hits(const ParticleSource& source) {
  return source.behaviour.dies_on_hit ? 1 : 4;
}

/// Bounds on the particles of an emitter, with and without the limit `max_alive`.
struct Bounds {
  effects::WorstCase possible, limited;
};

template <class Def, class... More>
Bounds bounds_of(Def def, const Bounds* parents, More... more) {
  const auto of = [&](const Def& d, const effects::WorstCase* from) {
    if constexpr (std::is_same_v<Def, effects::EmitterDef>)
      return effects::worst_case(d, more...);
    else
      return effects::worst_case(d, *from, more...);
  };
  const effects::WorstCase limited = of(def, parents ? &parents->limited : nullptr);
  if constexpr (requires { def.particles; })
    def.particles.max_alive = kNoLimit;
  else
    def.max_alive = kNoLimit;
  return {of(def, parents ? &parents->possible : nullptr), limited};
}

effects::WorstCase sum(const effects::WorstCase& a, const effects::WorstCase& b) {
  const auto add = [](uint64_t x, uint64_t y) { return x > kNoLimit - y ? kNoLimit : x + y; };
  return {add(a.born, b.born), add(a.alive, b.alive), std::max(a.lifespan, b.lifespan), a.at_once + b.at_once,
          a.rate + b.rate};
}

Bounds bounds_of_emitter(const Emitter& emitter, Real film_end) {
  effects::EmitterDef def = emitter_def(emitter, 0);
  effects::EmitterRelease& release = def.release;
  for (Varying* v :
       {&release.rate, &release.count, &release.interval, &def.particles.lifespan, &def.particles.radius})
    bound(*v);
  for (effects::Burst& burst : release.bursts) bound(burst.count);
  // The triangles of a model are not read yet. For the count this does not matter; particles on a model may
  // be postponed.
  if (def.surface.kind == effects::SurfaceKind::mesh)
    def.surface = {.kind = effects::SurfaceKind::sphere, .radius = 1e-9};
  return bounds_of(def, nullptr, film_end);
}

Bounds bounds_of_child(const ParticleSource& parent, const Emission& emission, const Bounds& parents) {
  if (emission.trail) {
    effects::TrailDef def = trail_def(*emission.trail, "", 0);
    for (Varying* v : {&def.release.rate, &def.particles.lifespan}) bound(*v);
    return bounds_of(def, &parents);
  }
  effects::SubEmitterDef def = event_def(emission, "", 0);
  for (Varying* v : {&def.release.count, &def.particles.lifespan}) bound(*v);

  return bounds_of(def, &parents, expected_hits(parent));
}

void add_split(const ParticleSource& source, Bounds& all) {
  if (!source.split) return;
  effects::SplitDef def = split_def(source, "", 0);
  for (Varying* v : {&def.count, &def.age, &def.delay, &def.lifespan_percent}) bound(*v);
  const Bounds children = bounds_of(def, &all, true);
  all = {sum(all.possible, children.possible), sum(all.limited, children.limited)};
  all.limited.alive = std::min(all.limited.alive, source.max_alive);
}

}  // namespace

sim::ParticleSystemDef system_def(const std::string& name, const sim::ParticleSystemDef& behaviour) {
  sim::ParticleSystemDef def = behaviour;
  def.name = name;
  return def;
}

sim::ParticleSystemDef system_def(const std::string& name, const ParticleSource& source) {
  sim::ParticleSystemDef def = system_def(name, source.behaviour);
  def.report_collisions = !source.on_collision.empty();
  def.report_deaths = !source.on_death.empty();
  return def;
}

effects::EmitterDef emitter_def(const Emitter& emitter, uint64_t seed) {
  return {.name = emitter.name,
          .seed = seed,
          .surface = std::visit([](const auto& s) { return surface_of(s); }, emitter.surface),
          .release = emitter,
          .particles = emitter};
}

effects::SplitDef split_def(const ParticleSource& source, const std::string& name, uint64_t seed) {
  effects::SplitDef def = *source.split;
  def.name = name + "/split";
  def.seed = seed;
  def.max_alive = source.max_alive;
  return def;
}

effects::TrailDef trail_def(const TrailSource& trail, const std::string& name, uint64_t seed) {
  return {.name = name, .seed = seed, .release = trail, .particles = trail};
}

effects::SubEmitterDef event_def(const Emission& emission, const std::string& name, uint64_t seed) {
  return {.name = name,
          .seed = seed,
          .trigger = emission.trigger,
          .age = emission.age,
          .release = *emission.event,
          .particles = *emission.event};
}

void bound_sources(
    const Emitter& emitter, Real film_end,
    const std::function<void(const ParticleSource&, const std::string&, const SourceBound&)>& visit) {
  std::map<const ParticleSource*, Bounds> known;
  for_each_source(emitter, [&](const ParticleSource& source, const ParticleSource* parent,
                               const std::string& name, const Emission& emission) {
    Bounds all =
        parent ? bounds_of_child(*parent, emission, known.at(parent)) : bounds_of_emitter(emitter, film_end);
    add_split(source, all);
    known[&source] = all;
    visit(source, name, {all.possible, all.limited.alive});
  });
}

}  // namespace offstage::producer
