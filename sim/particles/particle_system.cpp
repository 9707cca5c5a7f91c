#include "sim/particles/particle_system.h"

#include <algorithm>
#include <cmath>

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>

#include "sim/dynamics/flat.h"

namespace offstage::sim {
namespace {

/// Number of particles per task. The state of such a chunk stays in the second-level cache between
/// integration and sweep.
constexpr std::size_t kChunk = 1024;
/// For a particle that was created before the sub-step: number of integration steps per second until the
/// sub-step begins, and the greatest number of these steps.
constexpr Real kStepsBefore = 120, kMostStepsBefore = 10000;
/// Greatest number of hits on cloth in a sub-step, for particles that collide with particles.
constexpr int kMostClothHits = 8;
/// Particles at a distance from a body of less than this fraction of their radius may touch it, because
/// impulses may close the gap.
constexpr Real kNear = 0.2;
static_assert(kNear > ParticleContacts::kMargin);
/// Durations below this are rounding errors [s].
constexpr Real kRounding = 1e-11;

std::size_t chunk_count(std::size_t n) {
  return (n + kChunk - 1) / kChunk;
}

/// Returns a part of an array as a span.
template <class T>
std::span<T> part(std::vector<T>& v, std::size_t begin, std::size_t end) {
  return std::span(v).subspan(begin, end - begin);
}

}  // namespace

struct ParticleSystem::Scratch {
  IntegratorWorkspace integrator;
  std::vector<Vec3> position, velocity;  // at the start of the sub-step
};

/// A particle that hits a dynamic body, with its flight so far.
struct ParticleSystem::Striker {
  Real time;  // time of the hit, as a fraction of the sub-step
  std::size_t particle;
  Flight flight;
  bool integrated;
};

ParticleTally& ParticleTally::operator+=(const ParticleTally& t) {
  add(t);
  if (!lost) lost = t.lost;
  events.insert(events.end(), t.events.begin(), t.events.end());
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
  arrays.charge.push_back(p.charge);
  if (def.rotates) {
    arrays.angular_velocity.push_back(p.angular_velocity);
    arrays.orientation.push_back(Quat::Identity());
  }
  arrays.id.push_back(next_id);
  since_birth.push_back(elapsed);
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

/// Moves consecutive particles freely; `scratch` has their initial state. Before time 0 the forces of time 0
/// act.
void ParticleSystem::fly(const ParticleForces& forces, Real t, Real h, std::size_t begin, std::size_t end,
                         Scratch& scratch) {
  const auto x = part(arrays.position, begin, end), v = part(arrays.velocity, begin, end);
  scratch.position.assign(x.begin(), x.end());
  scratch.velocity.assign(v.begin(), v.end());
  const auto mass = part(arrays.mass, begin, end);
  t = std::max(t, 0.0);
  if (def.integrator == IntegratorKind::leapfrog && forces.fields.empty())
    return forces.leapfrog_step(h, x, v, mass);
  // The reset makes the result independent of the thread's previous particle, and so of the number of
  // threads.
  scratch.integrator.next_step = 0;
  const Integrator& wanted = integrator(def.integrator);
  Stiffness stiffness = forces.stiffness();
  if (def.integrator == IntegratorKind::leapfrog) stiffness.by_velocity = 0;  // stable for any drag
  const auto is_stable = [&](Real m) { return sim::is_stable(wanted, 1 / m * stiffness, h); };
  if (is_stable(std::ranges::max(mass)))
    wanted.step(FreeFlight(forces, mass), t, h, flat(x), flat(v), scratch.integrator);
  if (is_stable(std::ranges::min(mass))) return;
  // Light particles get steps of their own. The others do not depend on them.
  for (std::size_t i = 0; i < mass.size(); ++i) {
    if (is_stable(mass[i])) continue;
    x[i] = scratch.position[i];
    v[i] = scratch.velocity[i];
    stable_integrator(wanted, 1 / mass[i] * stiffness, h)
        .step(FreeFlight(forces, mass.subspan(i, 1)), t, h, flat(x.subspan(i, 1)), flat(v.subspan(i, 1)),
              scratch.integrator);
  }
}

/// Moves a particle freely until the sub-step begins, if it was created before time 0 or long before this
/// sub-step.
void ParticleSystem::fly_before(const ParticleForces& forces, Real t, std::size_t i, Real duration,
                                Scratch& scratch) {
  duration = std::min(duration, arrays.lifespan[i]);
  if (!(duration > kRounding)) return;
  const Real steps = std::clamp(std::ceil(duration * kStepsBefore), 1.0, kMostStepsBefore);
  for (Real k = 0; k < steps; ++k) fly(forces, t, duration / steps, i, i + 1, scratch);
  arrays.age[i] += duration;
}

void ParticleSystem::admit_new_particles(const ParticleForces& forces) {
  Scratch scratch;
  const std::size_t old = arrays.size() - since_birth.size();
  for (std::size_t i = old; i < arrays.size(); ++i) fly_before(forces, 0, i, since_birth[i - old], scratch);
  since_birth.clear();
}

/// Integrates every particle, and then calls make_landing(chunk)(i, flight, integrated). `integrated`:
/// whether a CoupledGroup integrated it before. Calls of one chunk are made in order; different chunks run in
/// parallel.
template <class MakeLanding>
void ParticleSystem::fly_each(const ParticleStage& stage, const ParticleForces& forces, bool coupled,
                              MakeLanding&& make_landing) {
  const std::size_t count = arrays.size(), old = count - since_birth.size();
  tbb::enumerable_thread_specific<Scratch> scratches;
  tbb::parallel_for(std::size_t{0}, chunk_count(old), [&](std::size_t chunk) {
    const std::size_t begin = chunk * kChunk, end = std::min(old, begin + kChunk);
    auto land = make_landing(chunk);
    Scratch& scratch = scratches.local();
    if (!coupled) fly(forces, stage.time, stage.h, begin, end, scratch);
    const Vec3* x0 = coupled ? &start_position_[begin] : scratch.position.data();
    const Vec3* v0 = coupled ? &start_velocity_[begin] : scratch.velocity.data();
    for (std::size_t i = begin; i < end; ++i) land(i, Flight{x0[i - begin], v0[i - begin], stage.h}, coupled);
  });

  // Each new particle has a flight time of its own.
  tbb::parallel_for(std::size_t{0}, chunk_count(since_birth.size()), [&](std::size_t chunk) {
    const std::size_t begin = old + chunk * kChunk, end = std::min(count, begin + kChunk);
    auto land = make_landing(chunk_count(old) + chunk);
    Scratch& scratch = scratches.local();
    for (std::size_t i = begin; i < end; ++i) {
      const bool integrated = coupled && whole_step(i);
      fly_before(forces, stage.time, i, since_birth[i - old] - stage.h, scratch);
      const Real duration = whole_step(i) ? stage.h : std::min(since_birth[i - old], stage.h);
      if (!integrated) fly(forces, stage.time + (stage.h - duration), duration, i, i + 1, scratch);
      const Vec3 x0 = integrated ? start_position_[i] : scratch.position[0];
      const Vec3 v0 = integrated ? start_velocity_[i] : scratch.velocity[0];
      land(i, Flight{x0, v0, duration}, integrated);
    }
  });
}

bool ParticleSystem::is_lost(std::size_t i, const Flight& flight, ParticleTally& tally) const {
  const Vec3 &x = arrays.position[i], &v = arrays.velocity[i];
  if (x.allFinite() && v.allFinite()) return false;
  if (!tally.lost) tally.lost = NonFinite{{}, arrays.id[i], flight.position, flight.velocity, x, v};
  ++tally.retired;
  return true;
}

/// Resolves the collisions of a particle with bodies after its flight.
SweepOutcome ParticleSystem::sweep(const ParticleStage& stage, const ParticleForces& forces,
                                   ParticleSweep& sweep, std::size_t i, const Flight& flight,
                                   bool integrated) {
  Vec3 &x = arrays.position[i], &v = arrays.velocity[i];
  ParticlePath path{flight.position,       flight.velocity,   x, v, arrays.mass[i], arrays.radius[i],
                    arrays.restitution[i], arrays.friction[i]};
  const bool more = integrated || !forces.fields.empty();
  const Vec3 extra = more ? Vec3((v - flight.velocity) / flight.duration -
                                 forces.acceleration((flight.velocity + v) / 2, path.mass))
                          : Vec3(Vec3::Zero());
  const SweepOutcome outcome = sweep(path, 1 - flight.duration / stage.h, extra);
  if (outcome.strikes_body) return outcome;
  x = path.end;
  v = path.end_velocity;
  return outcome;
}

/// Ends the sub-step of a particle. `spent`: whether a collision removed it.
void ParticleSystem::end(const ParticleStage& stage, std::size_t i, bool spent, bool trapped,
                         ParticleTally& tally) {
  tally.removed += trapped;
  tally.expired += spent;
  bool dead = trapped || spent;
  if (!dead && arrays.age[i] >= arrays.lifespan[i]) {
    ++tally.expired;
    dead = true;
    if (def.report_deaths) {
      const Real over = arrays.age[i] - arrays.lifespan[i];
      tally.events.push_back({ParticleEvent::Kind::death, handle, arrays.id[i], stage.time + stage.h - over,
                              arrays.position[i] - over * arrays.velocity[i], arrays.velocity[i],
                              Vec3::Zero(), arrays.mass[i], arrays.radius[i], arrays.lifespan[i]});
    }
  }
  if (!dead && !stage.bounds.contains(arrays.position[i])) {
    ++tally.retired;
    dead = true;
  }
  fate_[i] = dead ? Fate::dead : Fate::alive;
}

ParticleEvent ParticleSystem::collision_event(const ParticleStage& stage, std::size_t i,
                                              const Strike& strike) const {
  return {ParticleEvent::Kind::collision,
          handle,
          arrays.id[i],
          stage.time + strike.fraction * stage.h,
          strike.position,
          strike.velocity,
          strike.normal,
          arrays.mass[i],
          arrays.radius[i],
          arrays.age[i] - (1 - strike.fraction) * stage.h};
}

ParticleTally ParticleSystem::sum_up(std::span<const ParticleTally> tallies) {
  since_birth.clear();
  has_flown_ = false;
  on_bodies_.clear();
  is_on_body_.clear();
  ParticleTally sum;
  for (const ParticleTally& t : tallies) sum += t;
  if (sum.expired + sum.retired + sum.removed > 0) remove_dead();
  return sum;
}

Aabb ParticleSystem::reach(Real h, const Vec3& gravity) const {
  Aabb bounds;
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const Real reach = arrays.radius[i] + 2 * h * (arrays.velocity[i].norm() + h * gravity.norm());
    bounds.extend(arrays.position[i] - Vec3::Constant(reach));
    bounds.extend(arrays.position[i] + Vec3::Constant(reach));
  }
  return bounds;
}

void ParticleSystem::find_on_bodies(const ParticleStage& stage) {
  const std::size_t count = arrays.size();
  is_on_body_.assign(count, 0);
  tbb::parallel_for(std::size_t{0}, chunk_count(count), [&](std::size_t chunk) {
    NearObstacles near(stage.fixed, stage.moving);
    for (std::size_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
      const Vec3& end = arrays.position[i];
      if (!(duration_[i] > 0) || !end.allFinite() || !arrays.velocity[i].allFinite()) continue;
      near.find(start_position_[i], end, (1 + kNear) * arrays.radius[i]);
      if (std::ranges::none_of(near.all(), [](const Obstacle* o) { return o->is_dynamic(); })) continue;
      // Cloth may stop the particle before it reaches a body, so it must be met in the order of time.
      const Real from = 1 - duration_[i] / stage.h;
      is_on_body_[i] =
          stage.cloths.empty() || !stage.cloths.first_hit(start_position_[i], end, arrays.radius[i], from, 1);
    }
  });
  for (uint32_t i = 0; i < count; ++i)
    if (is_on_body_[i]) on_bodies_.push_back(i);
  if (on_bodies_.empty()) is_on_body_.clear();
}

/// Calls make_landing as fly_each() does, after fly_all().
template <class MakeLanding>
void ParticleSystem::land_flown(bool coupled, MakeLanding&& make_landing) {
  const std::size_t count = arrays.size(), old = count - since_birth.size(), chunks = chunk_count(old);
  tbb::parallel_for(std::size_t{0}, chunks + chunk_count(since_birth.size()), [&](std::size_t chunk) {
    const std::size_t begin = chunk < chunks ? chunk * kChunk : old + (chunk - chunks) * kChunk;
    const std::size_t end = std::min(chunk < chunks ? old : count, begin + kChunk);
    auto land = make_landing(chunk);
    for (std::size_t i = begin; i < end; ++i) land(i, flight(i), coupled && whole_step(i));
  });
}

ParticleTally ParticleSystem::step(const ParticleStage& stage, const ParticleForces& forces, bool coupled,
                                   std::span<const uint8_t> trapped) {
  const std::size_t old = arrays.size() - since_birth.size();
  fate_.resize(arrays.size());
  std::vector<ParticleTally> tallies(chunk_count(old) + chunk_count(since_birth.size()));
  std::vector<SweepLog> logs(tallies.size());
  std::vector<std::vector<Striker>> strikers(tallies.size());
  const auto make_landing = [&](std::size_t chunk) {
    logs[chunk].wants_strikes = def.report_collisions;
    return [&, chunk, &log = logs[chunk],
            obstacles = ParticleSweep(stage.fixed, stage.moving, stage.cloths, forces, stage.h, logs[chunk])](
               std::size_t i, const Flight& flight, bool integrated) mutable {
      if (!is_on_body_.empty() && is_on_body_[i]) return;
      ParticleTally& tally = tallies[chunk];
      if (!has_flown_) arrays.age[i] += flight.duration;
      if (is_lost(i, flight, tally)) {
        fate_[i] = Fate::dead;
        return;
      }
      SweepOutcome outcome;
      if (def.collides && flight.duration > 0) {
        const std::size_t reactions = log.reactions.size();
        outcome = sweep(stage, forces, obstacles, i, flight, integrated);
        if (outcome.strikes_body) {
          log.reactions.resize(reactions);
          log.strikes.clear();
          strikers[chunk].push_back({outcome.time, i, flight, integrated});
          return;
        }
      }
      finish_sweep(stage, i, outcome, log, tally);
    };
  };
  if (has_flown_)
    land_flown(coupled, make_landing);
  else
    fly_each(stage, forces, coupled, make_landing);
  std::vector<Striker> all;
  for (std::size_t chunk = 0; chunk < logs.size(); ++chunk) {
    for (const Reaction& r : logs[chunk].reactions) stage.impulses.push(r);
    all.insert(all.end(), strikers[chunk].begin(), strikers[chunk].end());
  }
  if (!all.empty()) strike_bodies(stage, forces, std::move(all), tallies.front());
  for (const uint32_t i : on_bodies_) {
    if (is_lost(i, flight(i), tallies.front())) {
      fate_[i] = Fate::dead;
      continue;
    }
    if (!stage.cloths.empty()) meet_cloths(stage, forces, i, tallies.front());
    end(stage, i, false, trapped[i], tallies.front());
  }
  return sum_up(tallies);
}

/// Processes the particles that hit dynamic bodies or cloth in sequence, in the order of time. Each particle
/// hits a body whose velocity includes the previous impulses.
void ParticleSystem::strike_bodies(const ParticleStage& stage, const ParticleForces& forces,
                                   std::vector<Striker> strikers, ParticleTally& tally) {
  std::sort(strikers.begin(), strikers.end(), [](const Striker& a, const Striker& b) {
    return a.time != b.time ? a.time < b.time : a.particle < b.particle;
  });
  SweepLog log;
  log.wants_strikes = def.report_collisions;
  ParticleSweep obstacles(stage.fixed, stage.moving, stage.cloths, forces, stage.h, log, &stage.impulses);
  for (const Striker& s : strikers) {
    const SweepOutcome outcome = sweep(stage, forces, obstacles, s.particle, s.flight, s.integrated);
    for (const Reaction& r : log.reactions) stage.impulses.push(r);
    log.reactions.clear();
    finish_sweep(stage, s.particle, outcome, log, tally);
  }
}

void ParticleSystem::finish_sweep(const ParticleStage& stage, std::size_t i, const SweepOutcome& outcome,
                                  SweepLog& log, ParticleTally& tally) {
  tally.collisions += outcome.collisions;
  tally.ejected += outcome.ejected;
  tally.truncated += outcome.truncated;
  for (const Strike& strike : log.strikes) tally.events.push_back(collision_event(stage, i, strike));
  log.strikes.clear();
  end(stage, i, outcome.hit && def.dies_on_hit, outcome.trapped, tally);
}

void ParticleSystem::fly_all(const ParticleStage& stage, const ParticleForces& forces, bool coupled) {
  start_position_.resize(arrays.size());
  start_velocity_.resize(arrays.size());
  duration_.resize(arrays.size());
  has_flown_ = true;
  fly_each(stage, forces, coupled, [&](std::size_t) {
    return [&](std::size_t i, const Flight& flight, bool) {
      start_position_[i] = flight.position;
      start_velocity_[i] = flight.velocity;
      duration_[i] = flight.duration;
      arrays.age[i] += flight.duration;
    };
  });
}

void ParticleSystem::meet_cloths(const ParticleStage& stage, const ParticleForces& forces,
                                 std::span<uint8_t> touched, ParticleTally& tally) {
  if (stage.cloths.empty() || !def.collides) return;
  for (std::size_t i = 0; i < arrays.size(); ++i)
    if (arrays.position[i].allFinite() && arrays.velocity[i].allFinite())
      touched[i] |= meet_cloths(stage, forces, i, tally);
}

/// Stops a particle at the cloths that it meets on the straight line from the start of its flight to its new
/// position. Returns whether there are any.
bool ParticleSystem::meet_cloths(const ParticleStage& stage, const ParticleForces& forces, std::size_t i,
                                 ParticleTally& tally) {
  ClothObstacles& cloths = stage.cloths;
  Vec3 &end = arrays.position[i], &v = arrays.velocity[i], start = start_position_[i];
  const Real mass = arrays.mass[i], radius = arrays.radius[i];
  Real from = 1 - duration_[i] / stage.h;
  bool touches = false;
  for (int hits = 0;; ++hits) {
    const auto hit = cloths.first_hit(start, end, radius, from, 1);
    if (!hit) return touches;
    touches = true;
    const Real gain = -stage.h * forces.acceleration(v, mass).dot(hit->normal);
    const ClothObstacles::Impact impact =
        cloths.collide(*hit, v, {mass, arrays.restitution[i], arrays.friction[i]}, gain);
    v += impact.impulse / mass;
    if (impact.strikes) {
      ++tally.collisions;
      if (def.report_collisions)
        tally.events.push_back(collision_event(stage, i, {hit->fraction, hit->position, v, hit->normal}));
    }
    if (hits + 1 == kMostClothHits) {
      end = cloths.held_end(hit->position, hit->position, radius, hit->fraction);
      ++tally.truncated;
      return touches;
    }
    // It slides on along the cloth, which it follows.
    const Vec3 at = hit->position - hit->distance * hit->normal + cloths.displacement(*hit);
    const Real behind = ClothObstacles::kept_distance(radius) - hit->normal.dot(end - at);
    if (behind > 0) end += behind * hit->normal;
    start = hit->position;
    from = hit->fraction;
  }
}

/// Turns a particle by its angular velocity over its flight.
void ParticleSystem::turn(std::size_t i) {
  const Vec3 angle = duration_[i] * arrays.angular_velocity[i];
  const Real size = angle.norm();
  if (size > 0)
    arrays.orientation[i] =
        (Quat(Eigen::AngleAxis<Real>(size, angle / size)) * arrays.orientation[i]).normalized();
}

ParticleTally ParticleSystem::end_step(const ParticleStage& stage, std::span<const uint8_t> touched,
                                       std::span<const uint8_t> trapped) {
  const std::size_t count = arrays.size();
  fate_.resize(count);
  std::vector<ParticleTally> tallies(chunk_count(count));
  tbb::parallel_for(std::size_t{0}, tallies.size(), [&](std::size_t chunk) {
    for (std::size_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
      if (is_lost(i, flight(i), tallies[chunk]))
        fate_[i] = Fate::dead;
      else
        end(stage, i, touched[i] && def.dies_on_hit, trapped[i], tallies[chunk]);
      if (def.rotates) turn(i);
    }
  });
  return sum_up(tallies);
}

void ParticleSystem::remove_dead() {
  const auto first_dead = std::find(fate_.begin(), fate_.end(), Fate::dead);
  const auto first = static_cast<std::size_t>(first_dead - fate_.begin());
  const auto compact = [&](auto& array) {
    if (array.empty()) return;
    std::size_t to = first;
    for (std::size_t i = first; i < array.size(); ++i)
      if (fate_[i] == Fate::alive) array[to++] = array[i];
    array.resize(to);
  };
  tbb::parallel_invoke([&] { compact(arrays.position); }, [&] { compact(arrays.velocity); },
                       [&] { compact(arrays.mass); }, [&] { compact(arrays.radius); },
                       [&] { compact(arrays.age); }, [&] { compact(arrays.lifespan); },
                       [&] { compact(arrays.restitution); }, [&] { compact(arrays.friction); },
                       [&] { compact(arrays.charge); }, [&] { compact(arrays.id); },
                       [&] { compact(arrays.angular_velocity); }, [&] { compact(arrays.orientation); });
}

}  // namespace offstage::sim
