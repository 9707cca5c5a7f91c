#include "producer/build/particle_sources.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "effects/blackbody.h"
#include "producer/build/emitter_defs.h"

namespace offstage::producer {
namespace {

effects::RampKind ramp_kind(const ParticleLook& look) {
  return look.ramp;
}

/// Returns the colours of a black body along a ramp of temperatures. Colour is not a linear function of
/// temperature, so the result has more keys than the ramp.
effects::ColorRamp glow_of(const std::vector<std::pair<Real, Real>>& kelvin) {
  constexpr int kSteps = 16;
  const auto hottest = static_cast<float>(
      std::ranges::max_element(kelvin, {}, [](const auto& key) { return key.second; })->second);
  effects::ColorRamp ramp;
  const auto add = [&](Real age, Real temperature) {
    const auto t = static_cast<float>(temperature);
    effects::Rgba rgba = effects::Rgba::Ones();
    rgba.head<3>() = effects::blackbody_color(t) * effects::blackbody_brightness(t, hottest);
    ramp.keys.push_back({age, rgba});
  };
  add(kelvin.front().first, kelvin.front().second);
  for (std::size_t i = 1; i < kelvin.size(); ++i) {
    const auto& [a0, t0] = kelvin[i - 1];
    const auto& [a1, t1] = kelvin[i];
    for (int k = 1; k <= kSteps; ++k) {
      const Real w = static_cast<Real>(k) / kSteps;
      add(a0 + w * (a1 - a0), t0 + w * (t1 - t0));
    }
  }
  return ramp;
}

bool is_zero(const Varying& v) {
  return effects::lower_bound(v) == 0 && effects::upper_bound(v) == 0;
}

/// Runs `add`, and converts the library's exception to a problem at the place in the scene.
template <class F>
void at_source(const Where& where, F&& add) {
  try {
    add();
  } catch (const std::invalid_argument& error) {
    throw SceneError(where, error.what());
  }
}

}  // namespace

LookRamps::LookRamps(const ParticleLook& look, uint64_t seed, const std::string& name)
    : start_{.mean = look.color.rgba,
             .deviation = look.channel_deviation.cast<float>(),
             .brightness_deviation = static_cast<float>(look.color_deviation)},
      random_(seed, effects::stream_id(name)),
      oriented_(look.style == LookStyle::mesh),
      turns_(look.turns() && !(is_zero(look.angle_deg) && is_zero(look.spin_deg_per_s))),
      angle_deg_(look.angle_deg),
      spin_deg_per_s_(look.spin_deg_per_s),
      turn_random_(seed, effects::stream_id(name + "/turn")) {
  effects::ColorRamp colors;
  for (const auto& [age, color] : look.color_over_age) colors.keys.push_back({age, color.rgba});
  if (!colors.keys.empty()) color_.emplace(colors, ramp_kind(look));
  if (!look.temperature_over_age.empty()) glow_.emplace(glow_of(look.temperature_over_age));
  effects::SizeRamp sizes;
  for (const auto& [age, size] : look.size_over_age) sizes.keys.push_back({age, static_cast<float>(size)});
  if (!sizes.keys.empty()) size_.emplace(sizes, ramp_kind(look));
}

PointSet LookRamps::points(const sim::ParticleArrays& particles, Real time,
                           const std::vector<ParticlePlace>* places) const {
  constexpr uint32_t kAngle = 0, kSpin = 1;
  constexpr Real kRadians = std::numbers::pi / 180, kTurn_deg = 360;
  const bool varies = start_.brightness_deviation > 0 || !start_.deviation.isZero(0);
  PointSet set;
  set.points.resize(particles.size());
  set.ages.resize(particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Real age = particles.age[i] / particles.lifespan[i];
    render::Point& p = set.points[i];
    p.position = particles.position[i].cast<float>();
    p.velocity = particles.velocity[i].cast<float>();
    p.radius = static_cast<float>(particles.radius[i]);
    p.id = particles.id[i];
    p.age = set.ages[i] = static_cast<float>(particles.age[i]);
    const bool own_color = places && (*places)[p.id].color;
    p.color = own_color ? (*places)[p.id].color->rgba : varies ? start_.of(random_, p.id) : start_.mean;
    if (color_) p.color = p.color.cwiseProduct(color_->at(age));
    if (glow_) p.color = p.color.cwiseProduct(glow_->at(age));
    if (size_) p.radius *= size_->at(age);
    if (oriented_ && !particles.orientation.empty())
      set.orientations.push_back(particles.orientation[i].cast<float>());
    if (!turns_) continue;
    const Real birth_time = time - particles.age[i];
    const Real angle = effects::sample(angle_deg_, turn_random_.uniform(p.id, kAngle), birth_time),
               spin = effects::sample(spin_deg_per_s_, turn_random_.uniform(p.id, kSpin), birth_time);
    p.angle = static_cast<float>(kRadians * std::fmod(angle + spin * particles.age[i], kTurn_deg));
    set.spins.push_back(static_cast<float>(kRadians * spin));
  }
  return set;
}

ParticleSources::ParticleSources(const Scene& scene, const ModelLibrary& models, sim::World& world,
                                 const FindBody& body) {
  for (const Emitter& emitter : scene.emitters) add(emitter, models, world, body, scene.world.seed);
}

void ParticleSources::add(const Emitter& emitter, const ModelLibrary& models, sim::World& world,
                          const FindBody& body, uint64_t seed) {
  std::map<const ParticleSource*, sim::ParticleSystemHandle> handles;
  for_each_source(emitter, [&](const ParticleSource& source, const ParticleSource* parent,
                               const std::string& name, const Emission& emission) {
    const auto system = world.add_particle_system(system_def(name, source));
    handles[&source] = system;
    systems_.push_back({name, system, LookRamps(source.look, seed, name)});
    at_source(source.where, [&] {
      if (!parent) {
        effects::EmitterDef def = emitter_def(emitter, seed);
        def.body = body(emitter.body);
        if (const auto* mesh = std::get_if<MeshSurface>(&emitter.surface))
          def.surface.mesh = collision_mesh(models.model(mesh->file), scale_of(*mesh, models));
        emitters_.emplace_back(def, system);
      } else if (emission.trail) {
        trails_.emplace_back(trail_def(*emission.trail, name, seed), handles.at(parent), system);
      } else {
        sub_emitters_.emplace_back(event_def(emission, name, seed), handles.at(parent), system);
      }
      if (source.split) splitters_.emplace_back(split_def(source, name, seed), system, system);
    });
  });
}

Real ParticleSources::prewarm() const {
  Real longest = 0;
  for (const effects::Emitter& emitter : emitters_)
    longest = std::max(longest, emitter.def().release.prewarm - emitter.def().release.start);
  return longest;
}

void ParticleSources::emit(sim::World& world, Real start, Real end) {
  for (effects::Emitter& emitter : emitters_) emitter.emit(world, start, end);
  for (effects::Splitter& splitter : splitters_) splitter.emit(world, start, end);
  for (effects::Trail& trail : trails_) trail.emit(world, start, end);
  for (effects::SubEmitter& sub_emitter : sub_emitters_) sub_emitter.emit(world, start, end);
}

ParticleSources::Counts ParticleSources::counts() const {
  Counts counts;
  for (const effects::Emitter& emitter : emitters_) {
    counts.waiting += emitter.report().waited;
    counts.skipped += emitter.report().skipped;
  }
  const auto add = [&](const auto& all) {
    for (const auto& one : all) counts.skipped += one.report().skipped;
  };
  add(splitters_), add(trails_), add(sub_emitters_);
  return counts;
}

void ParticleSources::add_points(const sim::World& world, std::vector<PointSet>& sets) const {
  for (const System& system : systems_)
    sets.push_back(system.look.points(world.particles(system.handle), world.time(), nullptr));
}

sim::ParticleSystemHandle ParticleSources::system(const std::string& name) const {
  const auto it = std::ranges::find(systems_, name, &System::name);
  return it == systems_.end() ? sim::ParticleSystemHandle{} : it->handle;
}

}  // namespace offstage::producer
