#include "sim/dynamics/particle_system.h"

#include <algorithm>
#include <cmath>

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>

namespace offstage::sim {
namespace {

/// Particles per task; a chunk's state stays in the second-level cache between integration and sweep.
constexpr std::size_t kChunk = 1024;

std::size_t chunk_count(std::size_t n) {
  return (n + kChunk - 1) / kChunk;
}

/// The part of an array that a range of indices covers.
template <class T>
std::span<T> part(std::vector<T>& v, std::size_t begin, std::size_t end) {
  return std::span(v).subspan(begin, end - begin);
}

}  // namespace

struct ParticleSystem::Scratch {
  IntegratorWorkspace integrator;
  std::vector<Vec3> position, velocity;  // at the start of the sub-step
};

ParticleTally& ParticleTally::operator+=(const ParticleTally& t) {
  expired += t.expired;
  retired += t.retired;
  ejected += t.ejected;
  removed += t.removed;
  collisions += t.collisions;
  truncated += t.truncated;
  if (!lost) lost = t.lost;
  return *this;
}

uint64_t ParticleSystem::add(const Particle& p, Real elapsed) {
  arrays.position.push_back(p.position);
  arrays.velocity.push_back(p.velocity);
  arrays.mass.push_back(p.mass);
  arrays.radius.push_back(p.radius);
  arrays.age.push_back(0);
  arrays.lifespan.push_back(p.lifespan);
  arrays.restitution.push_back(p.restitution);
  arrays.friction.push_back(p.friction);
  arrays.id.push_back(next_id);
  newborn.push_back(elapsed);
  return next_id++;
}

std::optional<std::size_t> ParticleSystem::find(uint64_t id) const {
  const auto it = std::lower_bound(arrays.id.begin(), arrays.id.end(), id);
  if (it == arrays.id.end() || *it != id) return std::nullopt;
  return static_cast<std::size_t>(it - arrays.id.begin());
}

void ParticleSystem::begin_coupled() {
  start_position_ = arrays.position;
  start_velocity_ = arrays.velocity;
}

/// Free flight of a run of particles, its start kept in `scratch`.
void ParticleSystem::fly(const ParticleForces& forces, Real t, Real h, std::size_t begin, std::size_t end,
                         Scratch& scratch) {
  const auto x = part(arrays.position, begin, end), v = part(arrays.velocity, begin, end);
  scratch.position.assign(x.begin(), x.end());
  scratch.velocity.assign(v.begin(), v.end());
  scratch.integrator.next_step = 0;  // whose step it was depends on the threads
  integrator(def.integrator)
      .step(FreeFlight(forces, part(arrays.mass, begin, end)), t, h, flat(x), flat(v), scratch.integrator);
}

/// Everything after integration for particle i, which started its `duration` at (x0, v0).
void ParticleSystem::settle(const ParticleStage& stage, const ParticleForces& forces, ParticleSweep& sweep,
                            std::size_t i, const Vec3& x0, const Vec3& v0, Real duration, bool coupled,
                            ParticleTally& tally) {
  Vec3 &x = arrays.position[i], &v = arrays.velocity[i];
  arrays.age[i] += duration;
  if (!x.allFinite() || !v.allFinite()) {
    if (!tally.lost) tally.lost = NonFinite{{}, arrays.id[i], x0, v0, x, v};
    ++tally.retired;
    fate_[i] = Fate::dead;
    return;
  }
  bool dead = false;
  if (def.collides && duration > 0) {
    ParticlePath path{
        x0, v0, x, v, arrays.mass[i], arrays.radius[i], arrays.restitution[i], arrays.friction[i]};
    const Vec3 extra = coupled ? Vec3((v - v0) / duration - forces.acceleration((v0 + v) / 2, path.mass))
                               : Vec3(Vec3::Zero());
    const SweepOutcome outcome = sweep(path, 1 - duration / stage.h, extra);
    x = path.end;
    v = path.end_velocity;
    tally.collisions += outcome.collisions;
    tally.ejected += outcome.ejected;
    tally.truncated += outcome.truncated;
    tally.removed += outcome.trapped;
    const bool spent = outcome.hit && def.dies_on_hit;
    tally.expired += spent;
    dead = outcome.trapped || spent;
  }
  if (!dead && arrays.age[i] >= arrays.lifespan[i]) {
    ++tally.expired;
    dead = true;
  }
  if (!dead && !stage.bounds.contains(x)) {
    ++tally.retired;
    dead = true;
  }
  fate_[i] = dead ? Fate::dead : Fate::alive;
}

ParticleTally ParticleSystem::step(const ParticleStage& stage, const ParticleForces& forces, bool coupled) {
  const std::size_t count = arrays.size(), old = count - newborn.size();
  fate_.resize(count);
  tbb::enumerable_thread_specific<Scratch> scratches;
  std::vector<ParticleTally> tallies(chunk_count(old) + chunk_count(newborn.size()));

  tbb::parallel_for(std::size_t{0}, chunk_count(old), [&](std::size_t chunk) {
    const std::size_t begin = chunk * kChunk, end = std::min(old, begin + kChunk);
    ParticleSweep sweep(stage.fixed, stage.moving, forces, stage.h);
    Scratch& scratch = scratches.local();
    if (!coupled) fly(forces, stage.time, stage.h, begin, end, scratch);
    const Vec3* x0 = coupled ? &start_position_[begin] : scratch.position.data();
    const Vec3* v0 = coupled ? &start_velocity_[begin] : scratch.velocity.data();
    for (std::size_t i = begin; i < end; ++i)
      settle(stage, forces, sweep, i, x0[i - begin], v0[i - begin], stage.h, coupled, tallies[chunk]);
  });

  // Each newborn has its own time to fly.
  tbb::parallel_for(std::size_t{0}, chunk_count(newborn.size()), [&](std::size_t chunk) {
    const std::size_t begin = old + chunk * kChunk, end = std::min(count, begin + kChunk);
    ParticleSweep sweep(stage.fixed, stage.moving, forces, stage.h);
    Scratch& scratch = scratches.local();
    ParticleTally& tally = tallies[chunk_count(old) + chunk];
    for (std::size_t i = begin; i < end; ++i) {
      const bool integrated = coupled && whole_step(i);
      const Real duration = whole_step(i) ? stage.h : std::min(newborn[i - old], stage.h);
      if (!integrated) fly(forces, stage.time + (stage.h - duration), duration, i, i + 1, scratch);
      const Vec3 x0 = integrated ? start_position_[i] : scratch.position[0];
      const Vec3 v0 = integrated ? start_velocity_[i] : scratch.velocity[0];
      settle(stage, forces, sweep, i, x0, v0, duration, integrated, tally);
    }
  });

  newborn.clear();
  ParticleTally sum;
  for (const ParticleTally& t : tallies) sum += t;
  if (sum.expired + sum.retired + sum.removed > 0) remove_dead();
  return sum;
}

void ParticleSystem::remove_dead() {
  const auto first_dead = std::find(fate_.begin(), fate_.end(), Fate::dead);
  const auto first = static_cast<std::size_t>(first_dead - fate_.begin());
  const auto compact = [&](auto& array) {
    std::size_t to = first;
    for (std::size_t i = first; i < array.size(); ++i)
      if (fate_[i] == Fate::alive) array[to++] = array[i];
    array.resize(to);
  };
  tbb::parallel_invoke(
      [&] { compact(arrays.position); }, [&] { compact(arrays.velocity); }, [&] { compact(arrays.mass); },
      [&] { compact(arrays.radius); }, [&] { compact(arrays.age); }, [&] { compact(arrays.lifespan); },
      [&] { compact(arrays.restitution); }, [&] { compact(arrays.friction); }, [&] { compact(arrays.id); });
}

}  // namespace offstage::sim
