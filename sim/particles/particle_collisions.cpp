#include "sim/particles/particle_collisions.h"

#include <algorithm>
#include <tuple>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {
namespace {

constexpr std::size_t kCollisionChunk = 1024;
/// Thickness of the layers as a multiple of the greatest radius. Particles in contact are in neighbouring
/// layers unless they are fast.
constexpr Real kLayer = 3;
/// The search distance of partners increases by this multiple of the greatest change of a path. The middle of
/// a path and half of its length each change by at most half of the change of the path, and by as much again
/// for a particle that was created within the sub-step.
constexpr Real kSlack = 3;

template <class F>
void for_each_chunked(std::size_t n, F&& f) {
  tbb::parallel_for(std::size_t{0}, (n + kCollisionChunk - 1) / kCollisionChunk, [&](std::size_t c) {
    for (std::size_t i = c * kCollisionChunk; i < std::min(n, (c + 1) * kCollisionChunk); ++i) f(i);
  });
}

}  // namespace

void ParticleCollisions::step(std::span<ParticleSystem* const> systems, const ParticleStage& stage,
                              ImpactLaw law, Real collision_speed, uint32_t lcp_cluster) {
  systems_ = systems;
  outcomes_.assign(systems.size(), {});
  strikes_.clear();
  reactions_.clear();
  gather(stage);
  sort();
  match();

  const ParticleStep step{stage.h, stage.fixed, stage.moving, law, collision_speed, stage.impulses};
  // Resting contact uses the velocities at the end. The partners were found with the mean velocities; they
  // can be used unless particles accelerate much in a sub-step.
  Real largest = 0, change = 0;
  for (const CollidingParticle& g : particles_) {
    largest = std::max(largest, g.radius);
    change = std::max(change, (stage.h - g.from) * (g.velocity - g.path_velocity).norm());
  }
  const Real margin = ParticleContacts::kMargin * largest;
  const bool changes_little = change < margin;
  search_.build(particles_, stage.h, changes_little ? margin + kSlack * change : margin);
  search_.list_partners(particles_);
  impacts_.resolve(particles_, search_, step, strikes_);

  for (const uint32_t i : impacts_.changed()) end_[i] = particles_[i].at(stage.h);
  for (CollidingParticle& g : particles_) g.path_velocity = g.velocity;
  if (!changes_little || !impacts_.changed().empty()) {
    search_.build(particles_, stage.h, margin);
    search_.list_partners(particles_);
  }
  touched_.assign(particles_.size(), 0);
  contacts_.solve(particles_, {layer_begin_, layer_, before_}, search_, impacts_, step, lcp_cluster, end_,
                  touched_, reactions_, strikes_);
  scatter(stage);
}

CollidingParticle ParticleCollisions::make_particles(const ParticleSystem& system, uint32_t number,
                                                     std::size_t i, Real h) const {
  const ParticleArrays& p = system.arrays;
  const ParticleSystem::Flight flight = system.flight(i);
  const Real duration = flight.duration;
  const Vec3 displacement = p.position[i] - flight.position;
  CollidingParticle g;
  g.position = flight.position;
  g.velocity = p.velocity[i];
  g.acceleration = duration > 0 ? Vec3((g.velocity - flight.velocity) / duration) : Vec3::Zero();
  g.path_velocity = duration > 0 ? Vec3(displacement / duration) : g.velocity;
  // Rounding errors do not count as a difference.
  if ((displacement - duration * g.velocity).norm() <= 1e-14 * (1 + p.position[i].norm()))
    g.path_velocity = g.velocity;
  g.from = h - duration;
  g.mass = p.mass[i];
  g.radius = p.radius[i];
  g.restitution = p.restitution[i];
  g.friction = p.friction[i];
  g.turning = system.def.rotates ? kBallTurning : 0;
  g.surface_spin = system.def.rotates ? Vec3(g.radius * p.angular_velocity[i]) : Vec3::Zero();
  g.system = number;
  g.internal = system.def.internal;
  g.external = system.def.external;
  g.hits_bodies = system.def.collides;
  return g;
}

/// Creates the colliding particles. Particles inside bodies are projected out.
void ParticleCollisions::gather(const ParticleStage& stage) {
  sources_.clear();
  for (uint32_t s = 0; s < systems_.size(); ++s) {
    const auto count = static_cast<uint32_t>(systems_[s]->arrays.size());
    outcomes_[s].touched.assign(count, 0);
    outcomes_[s].trapped.assign(count, 0);
    if (systems_[s]->hits_particles()) {
      for (uint32_t i = 0; i < count; ++i) sources_.push_back({s, i, false});
    } else {
      for (const uint32_t i : systems_[s]->on_bodies()) sources_.push_back({s, i, false});
    }
  }
  const std::size_t n = sources_.size();
  unsorted_.resize(n);
  free_end_.resize(n);
  std::vector<uint8_t> ejected(n, 0);
  for_each_chunked(n, [&](std::size_t k) {
    Source& source = sources_[k];
    const ParticleSystem& system = *systems_[source.system];
    const Vec3& x = system.arrays.position[source.index];
    if (!x.allFinite() || !system.arrays.velocity[source.index].allFinite()) return;
    CollidingParticle& g = unsorted_[k];
    g = make_particles(system, source.system, source.index, stage.h);
    free_end_[k] = x;
    source.is_particles = true;
    if (!g.hits_bodies) return;
    NearObstacles near(stage.fixed, stage.moving);
    near.find(g.position, free_end_[k], g.radius);
    bool deep = false;
    source.is_particles =
        near.all().empty() || near.eject(g.position, free_end_[k], g.radius, g.from / stage.h, deep);
    ejected[k] = deep;
    outcomes_[source.system].trapped[source.index] = !source.is_particles;
  });
  for (std::size_t k = 0; k < n; ++k) outcomes_[sources_[k].system].tally.ejected += ejected[k];
}

/// Orders the particles by layers.
void ParticleCollisions::sort() {
  members_.clear();
  places_.clear();
  Real largest = 0;
  for (uint32_t k = 0; k < sources_.size(); ++k) {
    if (!sources_[k].is_particles) continue;
    members_.push_back(k);
    places_.push_back(unsorted_[k].position);
    largest = std::max(largest, unsorted_[k].radius);
  }
  const std::size_t n = members_.size();
  order_.build(places_, kLayer * std::max(largest, 1e-6));
  particles_.resize(n);
  end_.resize(n);
  source_of_.resize(n);
  layer_.resize(n);
  layer_begin_.resize(order_.layers() + 1);
  for (uint32_t l = 0; l <= order_.layers(); ++l)
    layer_begin_[l] = static_cast<uint32_t>(order_.layer_begin(l));
  tbb::parallel_for(uint32_t{0}, order_.layers(), [&](uint32_t l) {
    for (uint32_t i = layer_begin_[l]; i < layer_begin_[l + 1]; ++i) {
      const uint32_t k = members_[order_.at(i)];
      source_of_[i] = k;
      particles_[i] = unsorted_[k];
      end_[i] = free_end_[k];
      layer_[i] = l;
    }
  });
}

/// Finds, for each particle, its entry of the previous step.
void ParticleCollisions::match() {
  std::vector<uint32_t> place(sources_.size(), ParticleContacts::kNone);
  for (uint32_t i = 0; i < source_of_.size(); ++i) place[source_of_[i]] = i;
  before_.assign(particles_.size(), ParticleContacts::kNone);
  std::vector<Known> now;
  auto old = known_.begin();
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    if (place[k] == ParticleContacts::kNone) continue;
    const ParticleSystem& system = *systems_[sources_[k].system];
    const Known known{system.handle, system.arrays.id[sources_[k].index], place[k]};
    const auto name = [](const Known& x) { return std::tie(x.system, x.id); };
    while (old != known_.end() && name(*old) < name(known)) ++old;
    if (old != known_.end() && name(*old) == name(known)) {
      before_[place[k]] = old->place;
      // Here the impacts and contacts are still those of the last sub-step.
      particles_[place[k]].carrier = std::max(contacts_.carrier(old->place), impacts_.struck(old->place),
                                              [](const auto& a, const auto& b) { return a.speed < b.speed; });
    }
    now.push_back(known);
  }
  known_ = std::move(now);
}

/// Writes the results back to the particle systems, with the collisions.
void ParticleCollisions::scatter(const ParticleStage& stage) {
  for (const ParticleStrike& strike : strikes_) touched_[strike.particle] = 1;
  for_each_chunked(particles_.size(), [&](std::size_t i) {
    const Source& source = sources_[source_of_[i]];
    ParticleArrays& p = systems_[source.system]->arrays;
    p.position[source.index] = end_[i];
    p.velocity[source.index] = particles_[i].velocity;
    if (particles_[i].turning > 0) p.angular_velocity[source.index] = particles_[i].angular_velocity();
    outcomes_[source.system].touched[source.index] = touched_[i];
  });
  std::stable_sort(strikes_.begin(), strikes_.end(), [&](const ParticleStrike& a, const ParticleStrike& b) {
    return source_of_[a.particle] != source_of_[b.particle] ? source_of_[a.particle] < source_of_[b.particle]
                                                            : a.time < b.time;
  });
  for (const ParticleStrike& s : strikes_) {
    const Source& source = sources_[source_of_[s.particle]];
    const ParticleSystem& system = *systems_[source.system];
    ParticleTally& tally = outcomes_[source.system].tally;
    ++tally.collisions;
    if (system.def.report_collisions)
      tally.events.push_back(
          system.collision_event(stage, source.index, {s.time / stage.h, s.position, s.velocity, s.normal}));
  }
  for (const Reaction& r : reactions_) stage.impulses.push(r);
}

}  // namespace offstage::sim
