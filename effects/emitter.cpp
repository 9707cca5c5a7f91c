#include "effects/emitter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "effects/limits.h"
#include "effects/particle_draws.h"

namespace offstage::effects {
namespace {

/// A release that was interrupted because there was no room continues after at most this time, even if its
/// particles are slow [s].
constexpr Real kMaxClearing = 1;
/// Number of random places that are tried for one particle. If half of the surface is occupied, most random
/// places are not free.
constexpr uint32_t kTries = 64;
/// Where new particles keep their distance from living ones, room is sought again after the time in which a
/// particle moves by this fraction of its diameter, but at most this number of times in a sub-step.
constexpr Real kClearedPart = 0.25;
constexpr uint64_t kMaxRetries = 16;
/// Greatest number of waiting particles for which room is sought at once. An emitter with a high rate may
/// have millions, for which there is no room.
constexpr uint64_t kMostRetried = 10'000;

std::string owner(const EmitterDef& def) {
  return "emitter \"" + def.name + "\"";
}

const EmitterDef& checked_emitter(const EmitterDef& def) {
  const auto verify = [&](const char* field, const Varying& v, const Limits& limits) {
    check(owner(def), field, v, limits);
  };
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw std::invalid_argument(owner(def) + ": " + what);
  };
  verify("rate", def.release.rate, kRates);
  verify("rate_per_metre", def.release.rate_per_metre, kRates);
  require(def.release.inherit_velocity >= 0 && std::isfinite(def.release.inherit_velocity),
          "inherit_velocity must be >= 0");
  verify("count", def.release.count, kCounts);
  verify("interval", def.release.interval, kIntervals);
  check_particles(owner(def), def.particles);
  for (const Burst& b : def.release.bursts) {
    verify("bursts.count", b.count, kCounts);
    verify("bursts.interval", b.interval, kIntervals);
    require(b.cycles >= 1, "bursts.cycles must be >= 1");
  }
  for (const TimeWindow& w : def.release.windows)
    require(w.start < w.end, "windows must end after they start");
  require(def.release.prewarm >= 0 && std::isfinite(def.release.prewarm), "prewarm must be >= 0");
  require(def.release.direction.allFinite(), "direction must be finite");
  return def;
}

ReleaseSurface surface_of(const EmitterDef& def) {
  try {
    return ReleaseSurface(def.surface);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(owner(def) + ": " + e.what());
  }
}

}  // namespace

Emitter::Emitter(const EmitterDef& def, sim::ParticleSystemHandle target, Real origin)
    : def_(checked_emitter(def)),
      target_(target),
      origin_(origin),
      stopped_(std::numeric_limits<Real>::infinity()),
      random_(def.seed, stream_id(def.name)),
      surface_(surface_of(def)),
      schedule_(def, origin),
      retry_(-std::numeric_limits<Real>::infinity()),
      turn_{0, 0, 0} {
  if (!def_.release.direction.isZero()) def_.release.direction.normalize();
}

void Emitter::stop(Real time) {
  stopped_ = std::min(stopped_, time);
  schedule_.stop(time);
}

/// Collects all releases that are due up to the time `end` [s], in order of time. At equal times, postponed
/// releases come first.
void Emitter::collect_due(Real end) {
  if (end > stopped_) std::erase_if(waiting_, [&](const Release& r) { return r.time > stopped_; });
  const auto still_waiting = std::stable_partition(waiting_.begin(), waiting_.end(),
                                                   [&](const Release& r) { return r.time <= end; });
  due_.assign(waiting_.begin(), still_waiting);
  waiting_.erase(waiting_.begin(), still_waiting);
  schedule_.collect(end, due_);
  std::stable_sort(due_.begin(), due_.end(),
                   [](const Release& a, const Release& b) { return a.time < b.time; });
}

/// Adds the particles along the body's path in this sub-step, which is straight.
void Emitter::collect_along_path(const sim::World& world, Real start, Real end) {
  const Real rate = mean(def_.release.rate_per_metre, start - origin_);
  if (!def_.body || !(rate > 0) || start < origin_ + def_.release.start || end > origin_ + def_.release.end ||
      end > stopped_)
    return;
  const auto place = [&](Real time) {
    return world.body_motion(def_.body, time).pose.point_to_world(def_.surface.pose.position);
  };
  const Real due = rate * (place(end) - place(start)).norm(), total = path_fraction_ + due;
  const auto count = static_cast<uint64_t>(std::min(total, static_cast<Real>(def_.particles.max_alive)));
  for (uint64_t k = 1; k <= count; ++k) {
    const Real fraction = std::clamp((static_cast<Real>(k) - path_fraction_) / due, 0.0, 1.0);
    due_.push_back({start + fraction * (end - start), 1});
  }
  path_fraction_ = total - std::floor(total);
}

void Emitter::emit(sim::World& world, Real start, Real end) {
  collect_due(end);
  if (def_.body && !world.is_present(def_.body)) {
    // Releases that are due while the body is absent are discarded.
    due_.clear();
    waiting_.clear();
    report_.waiting = 0;
    return;
  }
  collect_along_path(world, start, end);
  std::stable_sort(due_.begin(), due_.end(),
                   [](const Release& a, const Release& b) { return a.time < b.time; });
  find_neighbours(world, start, end);
  // The list may grow during the loop, because the postponed rest of a release may be due within this
  // sub-step.
  for (std::size_t i = 0; i < due_.size(); ++i) release(world, Release(due_[i]), start, end);
  report_.waiting = 0;
  for (const Release& r : waiting_) report_.waiting += r.count;
}

/// Returns the largest diameter of the next `count` particles [m].
Real Emitter::largest_diameter(uint64_t count, Real birth_time) const {
  Real radius = upper_bound(def_.particles.radius);
  if (std::isinf(radius)) {
    radius = 0;
    for (uint64_t k = 0; k < count; ++k)
      radius =
          std::max(radius, Draws(random_, number_ + k, birth_time - origin_)(def_.particles.radius, kRadius));
  }
  return 2 * radius;
}

/// Finds the living particles that new ones must not overlap in this sub-step.
void Emitter::find_neighbours(const sim::World& world, Real start, Real end) {
  meets_particles_ = !due_.empty() && !def_.release.overlap && Neighbours::exist(world, target_);
  if (!meets_particles_) return;
  const auto centre = [&](Real time) {
    const Vec3& own = def_.surface.pose.position;
    return def_.body ? world.body_motion(def_.body, time).pose.point_to_world(own) : own;
  };
  uint64_t count = 0;
  for (const Release& r : due_) count += r.waited ? std::min(r.count, kMaxRetries * kMostRetried) : r.count;
  const Vec3 first = centre(start), last = centre(end);
  const Real reach = surface_.reach() + largest_diameter(count, start) + (last - first).norm() / 2;
  neighbours_.collect(world, target_, (first + last) / 2, reach, start, end);
}

void Emitter::release(sim::World& world, const Release& r, Real start, Real end) {
  if (meets_particles_ && r.time < retry_) {
    report_.waited += r.waited ? 0 : r.count;
    return postpone({retry_, r.count, r.together, true}, end);
  }
  const uint64_t alive = world.particles(target_).size();
  const uint64_t allowed =
      std::min(r.count, def_.particles.max_alive > alive ? def_.particles.max_alive - alive : 0);
  if (allowed > 0) {
    // Without waiting, particles that were due earlier belong to the prewarm.
    const Real birth_time = r.waited ? std::max(r.time, start) : r.time;
    const uint64_t tried = meets_particles_ && r.waited ? std::min(allowed, kMostRetried) : allowed;
    const Batch batch{tried,
                      r.together,
                      birth_time,
                      end,
                      largest_diameter(tried, birth_time),
                      def_.body ? world.body_motion(def_.body, std::max(birth_time, start)) : sim::Motion{}};
    const uint64_t placed = place(world, batch);
    report_.released += placed;
    if (placed < allowed) wait(batch, allowed - placed, r.waited, start);
  }
  // Particles over the limit also use up their numbers, so that the random numbers of other particles do not
  // depend on the limit.
  report_.skipped += r.count - allowed;
  number_ += r.count - allowed;
}

/// Postpones the rest of a release until there may be room.
void Emitter::wait(const Batch& batch, uint64_t rest, bool waited, Real start) {
  const Real speed = std::abs(mean(def_.particles.speed, batch.birth_time - origin_));
  const Real clearing = std::min(kMaxClearing, batch.diameter / speed);
  if (!waited) report_.waited += rest;
  Real next = batch.birth_time + clearing;
  if (meets_particles_) {
    const Real pause =
        std::max(kClearedPart * clearing, (batch.end - start) / static_cast<Real>(kMaxRetries));
    next = retry_ = std::min(batch.birth_time + pause, batch.end);
  }
  postpone({next, rest, batch.together, true}, batch.end);
}

/// Adds a release to the postponed ones, which stay in order of time. Those that wait for the same attempt
/// are joined, so that their number is bounded.
void Emitter::postpone(const Release& rest, Real end) {
  if (rest.time > stopped_) return;
  auto& list = rest.time < end ? due_ : waiting_;
  const auto [same, after] = std::ranges::equal_range(list, rest.time, {}, &Release::time);
  for (Release& r : std::ranges::subrange(same, after))
    if (r.waited && r.together == rest.together) {
      r.count += rest.count;
      return;
    }
  list.insert(after, rest);
}

/// Returns the number of particles for which there was room.
uint64_t Emitter::place(sim::World& world, const Batch& batch) {
  if (def_.release.overlap) return place_anywhere(world, batch);
  const bool in_cells = surface_.has_cells() && (batch.together || !meets_particles_);
  // More particles may wait than there is room for.
  const Real room = 1 + 4 * surface_.area() / (batch.diameter * batch.diameter);
  const uint64_t expected = std::min(batch.count, static_cast<uint64_t>(std::min(room, 1e12)));
  if (meets_particles_)
    neighbours_.place_into(spacing_, expected, batch.diameter, batch.birth_time, batch.carrier.pose,
                           def_.surface.pose);
  else if (!in_cells)
    spacing_.reset(expected, batch.diameter);
  return in_cells ? place_in_cells(world, batch) : place_apart(world, batch);
}

uint64_t Emitter::place_anywhere(sim::World& world, const Batch& batch) {
  for (uint64_t k = 0; k < batch.count; ++k) {
    const Draws draw(random_, number_++, batch.birth_time - origin_);
    add(world, draw, surface_.anywhere(draw.uniforms(kPlace)), batch);
  }
  return batch.count;
}

/// Places particles until no cell of the surface is free.
uint64_t Emitter::place_in_cells(sim::World& world, const Batch& batch) {
  const Cells cells = surface_.cells(batch.diameter);
  const uint64_t n = cells.count();
  const Permutation shuffled(n, def_.seed);
  begin_cells(cells, std::min(batch.count, n));
  uint64_t placed = 0;
  for (uint64_t tried = 0; placed < batch.count && tried < n; ++tried) {
    const Draws draw(random_, number_, batch.birth_time - origin_);
    const Place place = surface_.cell(cells, shuffled(cell_cursor_++ % n), turn_);
    if (meets_particles_ && !is_free(place, draw)) continue;
    add(world, draw, place, batch);
    ++placed;
    ++number_;
  }
  return placed;
}

/// Rotates the cells of a sphere or a disc for each round through them. A release that does not fit into the
/// current round begins with the next one, because the cells of two rounds may overlap.
void Emitter::begin_cells(const Cells& cells, uint64_t count) {
  if (def_.surface.kind == SurfaceKind::plane) return;
  const uint64_t n = cells.count(), done = cell_cursor_ % n;
  if (done + count > n) cell_cursor_ += n - done;
  const uint64_t round = cell_cursor_ / n + 1;
  if (round == turned_round_) return;
  turned_round_ = round;
  turn_ = Draws(random_, round, 0).uniforms(kTurn);
}

/// Places particles until there is no room for the next one; the next call starts with that particle.
uint64_t Emitter::place_apart(sim::World& world, const Batch& batch) {
  for (uint64_t k = 0; k < batch.count; ++k, ++number_) {
    const Draws draw(random_, number_, batch.birth_time - origin_);
    const Real radius = draw(def_.particles.radius, kRadius);
    Place place;
    uint32_t t = 0;
    do {
      if (t == kTries) return k;
      place = surface_.anywhere(draw.uniforms(kPlace + 3 * t++), radius);
    } while (!is_free(place, draw));
    add(world, draw, place, batch);
  }
  return batch.count;
}

/// Whether the next particle has room at a place; if so, the place is occupied from now on.
bool Emitter::is_free(const Place& place, const Draws& draw) {
  const Real radius = draw(def_.particles.radius, kRadius);
  return spacing_.add(place.point + radius * place.normal, radius);
}

/// Adds a particle that touches the surface from outside.
void Emitter::add(sim::World& world, const Draws& draw, const Place& place, const Batch& batch) {
  sim::Particle particle = drawn_particle(def_.particles, draw);
  const sim::Pose &surface = def_.surface.pose, &carrier = batch.carrier.pose;
  const bool along_normal = def_.release.direction.isZero(0);
  const Vec3 axis = along_normal ? place.normal : def_.release.direction;
  Vec3 direction =
      Cone{axis, along_normal ? place.tangent : perpendicular(axis)}.drawn(def_.particles.spread_deg, draw);
  if (along_normal) direction = surface.vector_to_world(direction);

  particle.position =
      carrier.point_to_world(surface.point_to_world(place.point + particle.radius * place.normal));
  const Vec3 own = draw(def_.particles.speed, kSpeed) * carrier.vector_to_world(direction);
  const Vec3 arm = particle.position - carrier.position;
  const Real fraction = def_.release.inherit_velocity;
  particle.velocity =
      own + fraction * batch.carrier.velocity + fraction * batch.carrier.angular_velocity.cross(arm);
  if (def_.release.recoil && def_.body) world.add_impulse(def_.body, -particle.mass * own, particle.position);
  world.add_particle(target_, particle, batch.end - batch.birth_time);
  if (meets_particles_) neighbours_.add(particle, batch.birth_time);
}

}  // namespace offstage::effects
