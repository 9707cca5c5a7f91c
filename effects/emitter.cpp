#include "effects/emitter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace offstage::effects {
namespace {

constexpr Real kNever = std::numeric_limits<Real>::infinity();
constexpr Real kPi = std::numbers::pi;
/// How long a random rate keeps its value [s].
constexpr Real kRateWindow = 0.1;
/// Windows without a particle after which a random rate counts as zero for ever: almost three hours.
constexpr int kMaxIdleWindows = 100'000;
constexpr Real kMaxRate = 1e9, kMaxCount = 1e9, kMinInterval = 1e-6;
/// A release that filled its cells goes on after this time at the latest, however slow its particles are [s].
constexpr Real kMaxClearing = 1;

/// What a random number is drawn for. Values are part of every scene's result: append, never renumber.
enum Property : uint32_t {
  kRate,
  kCount,
  kInterval,
  kSpeed,
  kSpread,
  kAzimuth,
  kRadius,
  kDensity,
  kMass,
  kLifespan,
  kRestitution,
  kFriction,
  kBurst,  // + its place in the list
};

struct Limits {
  Real low, high;
  bool low_open;  // `low` itself is not allowed
};

/// Refuses what cannot be drawn from. Closed limits cut a distribution off (F2); an open one must be set
/// explicitly.
void check(const EmitterDef& def, const char* field, const Varying& v, const Limits& limits) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument("emitter \"" + def.name + "\": " + field + ' ' + what);
  };
  if (const auto* n = std::get_if<Normal>(&v)) {
    if (!(n->deviation >= 0)) refuse("has a negative deviation");
    if (!(n->min <= n->max)) refuse("has min > max");
  }
  if (const auto* u = std::get_if<Uniform>(&v); u && !(u->low <= u->high))
    refuse("has a range with its ends exchanged");
  if (const auto* c = std::get_if<Curve>(&v)) {
    if (c->keys.empty()) refuse("is a curve without keys");
    for (std::size_t i = 1; i < c->keys.size(); ++i)
      if (!(c->keys[i - 1].first < c->keys[i].first)) refuse("is a curve whose times do not increase");
  }
  const Real low = lower_bound(v), high = upper_bound(v);
  if (std::isnan(low) || std::isnan(high)) refuse("is not a number");
  if (limits.low_open && !(low > limits.low))
    refuse("can be " + std::to_string(low) + ", allowed is > " + std::to_string(limits.low) +
           "; give it a min");
  if (high < limits.low || low > limits.high)
    refuse("is outside " + std::to_string(limits.low) + " to " + std::to_string(limits.high));
}

void check(const EmitterDef& def) {
  constexpr Real kMax = std::numeric_limits<Real>::max();
  check(def, "rate", def.rate, {0, kMaxRate, false});
  check(def, "count", def.count, {0, kMaxCount, false});
  check(def, "interval", def.interval, {kMinInterval, kMax, true});
  check(def, "speed", def.speed, {-kMax, kMax, false});
  check(def, "spread_deg", def.spread_deg, {-180, 180, false});
  check(def, "radius", def.radius, {0, kMax, true});
  check(def, "mass", def.mass, {0, kMax, false});
  if (upper_bound(def.mass) <= 0) check(def, "density", def.density, {0, kMax, true});
  check(def, "lifespan", def.lifespan, {0, kMax, true});
  check(def, "restitution", def.restitution, {0, 1, false});
  check(def, "friction", def.friction, {0, kMax, false});
  for (const Burst& b : def.bursts) {
    check(def, "bursts.count", b.count, {0, kMaxCount, false});
    check(def, "bursts.interval", b.interval, {kMinInterval, kMax, true});
    if (b.cycles < 1) throw std::invalid_argument("emitter \"" + def.name + "\": bursts.cycles must be >= 1");
  }
  if (!(def.surface.size.x() > 0 && def.surface.size.y() > 0))
    throw std::invalid_argument("emitter \"" + def.name + "\": surface.size must be > 0");
}

uint64_t rounded(Real x) {
  return static_cast<uint64_t>(std::floor(std::clamp(x, 0.0, kMaxCount) + 0.5));
}

/// Where the integral of a rate over time, taken from t, reaches 1.
Real curve_birth(const Varying& rate, const Curve& curve, Real t) {
  const auto at = [&](Real time) { return std::max(0.0, sample(rate, 0.5, time)); };
  Real need = 1;
  for (const auto& [key, value] : curve.keys) {
    if (key <= t) continue;
    const Real span = key - t, r0 = at(t), slope = (std::max(0.0, value) - r0) / span;
    const Real area = (r0 + slope * span / 2) * span;
    // r0 s + slope s^2 / 2 = need, in the form that also serves slope = 0 or r0 = 0.
    if (area >= need) return t + 2 * need / (r0 + std::sqrt(std::max(0.0, r0 * r0 + 2 * slope * need)));
    need -= area;
    t = key;
  }
  const Real held = at(t);
  return held > 0 ? t + need / held : kNever;
}

}  // namespace

Emitter::Emitter(const EmitterDef& def, sim::ParticleSystemHandle target)
    : def_(def),
      target_(target),
      random_(def.seed, stream_id(def.name)),
      burst_cycles_(def.bursts.size(), 0) {
  check(def);
  next_single_ = next_birth(def.start);
  next_periodic_ = upper_bound(def.count) >= 0.5 ? def.start : kNever;
}

Real Emitter::draw(const Varying& v, uint64_t number, uint32_t property, Real time) const {
  return sample(v, random_.uniform(number, property), time);
}

/// Time of the particle of `rate` after the one at `last`.
Real Emitter::next_birth(Real last) {
  if (const auto* constant = std::get_if<Real>(&def_.rate))
    return *constant > 0 ? def_.start + static_cast<Real>(singles_ + 1) / *constant : kNever;
  if (const auto* curve = std::get_if<Curve>(&def_.rate)) return curve_birth(def_.rate, *curve, last);
  Real need = 1, t = last;
  for (int idle = 0; idle < kMaxIdleWindows; ++idle) {
    const Real window_end = def_.start + static_cast<Real>(rate_window_ + 1) * kRateWindow;
    const Real rate = std::clamp(draw(def_.rate, rate_window_, kRate, t), 0.0, kMaxRate);
    if (rate * (window_end - t) >= need) return t + need / rate;
    need -= rate * (window_end - t);
    t = window_end;
    ++rate_window_;
  }
  return kNever;
}

void Emitter::collect_singles(Real end) {
  for (; next_single_ <= end; next_single_ = next_birth(next_single_)) {
    due_.push_back({next_single_, 1});
    ++singles_;
  }
}

void Emitter::collect_periodic(Real end) {
  while (next_periodic_ <= end) {
    due_.push_back({next_periodic_, rounded(draw(def_.count, periodic_, kCount, next_periodic_))});
    ++periodic_;
    const auto* constant = std::get_if<Real>(&def_.interval);
    next_periodic_ = constant ? def_.start + static_cast<Real>(periodic_) * *constant
                              : next_periodic_ + draw(def_.interval, periodic_, kInterval, next_periodic_);
  }
}

void Emitter::collect_bursts(Real end) {
  for (std::size_t i = 0; i < def_.bursts.size(); ++i) {
    const Burst& b = def_.bursts[i];
    for (uint64_t& cycle = burst_cycles_[i]; cycle < static_cast<uint64_t>(b.cycles); ++cycle) {
      const Real time = b.time + static_cast<Real>(cycle) * b.interval;
      if (time > end) break;
      due_.push_back({time, rounded(draw(b.count, cycle, kBurst + static_cast<uint32_t>(i), time))});
    }
  }
}

/// Everything to be born up to `end`, in order of time; at one time what waited comes first.
void Emitter::collect_due(Real end) {
  const auto still_waiting = std::stable_partition(waiting_.begin(), waiting_.end(),
                                                   [&](const Release& r) { return r.time <= end; });
  due_.assign(waiting_.begin(), still_waiting);
  waiting_.erase(waiting_.begin(), still_waiting);
  const Real last = std::min(end, def_.end);
  collect_singles(last);
  collect_periodic(last);
  collect_bursts(last);
  std::stable_sort(due_.begin(), due_.end(),
                   [](const Release& a, const Release& b) { return a.time < b.time; });
}

void Emitter::emit(sim::World& world, Real start, Real end) {
  collect_due(end);
  // The list grows while it is worked off: the rest of a release may still be due in this sub-step.
  for (std::size_t i = 0; i < due_.size(); ++i) release(world, Release(due_[i]), start, end);
  report_.waiting = 0;
  for (const Release& r : waiting_) report_.waiting += r.count;
}

Emitter::Grid Emitter::grid_of(const Release& r) const {
  Real radius = upper_bound(def_.radius);
  if (std::isinf(radius)) {
    radius = 0;
    for (uint64_t k = 0; k < r.count; ++k)
      radius = std::max(radius, draw(def_.radius, number_ + k, kRadius, r.time));
  }
  const Real edge = 2 * radius;
  // A surface of whole cells has them all, in spite of rounding; one smaller than a particle has one.
  const auto cells = [&](Real length) {
    return static_cast<uint64_t>(std::max(1.0, std::floor(length / edge + 1e-9)));
  };
  return {edge, cells(def_.surface.size.x()), cells(def_.surface.size.y())};
}

void Emitter::release(sim::World& world, const Release& r, Real start, Real end) {
  const uint64_t alive = world.particles(target_).size();
  const uint64_t allowed = std::min(r.count, def_.max_alive > alive ? def_.max_alive - alive : 0);
  const Real birth = std::max(r.time, start);
  if (allowed > 0) {
    const Grid grid = grid_of({r.time, allowed});
    const uint64_t placed = std::min(allowed, grid.nx * grid.nz);
    for (uint64_t k = 0; k < placed; ++k) place(world, number_++, grid, birth, end);
    report_.released += placed;
    if (placed < allowed) {
      const Real clearing = std::min(kMaxClearing, grid.edge / std::abs(mean(def_.speed, r.time)));
      if (!r.waited) report_.waited += allowed - placed;
      wait({birth + clearing, allowed - placed, true}, end);
    }
  }
  // Those over the limit have their numbers too, so that the others' draws do not depend on it.
  report_.skipped += r.count - allowed;
  number_ += r.count - allowed;
}

/// Puts the rest of a release off, in order of time among the others.
void Emitter::wait(const Release& rest, Real end) {
  auto& list = rest.time <= end ? due_ : waiting_;
  const auto after = std::upper_bound(list.begin(), list.end(), rest,
                                      [](const Release& a, const Release& b) { return a.time < b.time; });
  list.insert(after, rest);
}

Vec3 Emitter::cell_centre(const Grid& grid, uint64_t cell) const {
  const auto along = [](uint64_t i, uint64_t n, Real length) {
    return ((static_cast<Real>(i) + 0.5) / static_cast<Real>(n) - 0.5) * length;
  };
  return {along(cell % grid.nx, grid.nx, def_.surface.size.x()), 0,
          along(cell / grid.nx, grid.nz, def_.surface.size.y())};
}

/// Adds particle `number` at the next cell of the shuffled sequence. It sits on the surface, touching it from
/// outside.
void Emitter::place(sim::World& world, uint64_t number, const Grid& grid, Real birth, Real end) {
  const auto property = [&](const Varying& v, Property p) { return draw(v, number, p, birth); };
  sim::Particle particle;
  particle.radius = property(def_.radius, kRadius);
  particle.lifespan = property(def_.lifespan, kLifespan);
  particle.restitution = std::clamp(property(def_.restitution, kRestitution), 0.0, 1.0);
  particle.friction = std::max(0.0, property(def_.friction, kFriction));
  particle.mass = property(def_.mass, kMass);
  if (!(particle.mass > 0))
    particle.mass =
        property(def_.density, kDensity) * 4 / 3 * kPi * particle.radius * particle.radius * particle.radius;

  const uint64_t cells = grid.nx * grid.nz;
  const uint64_t cell = Permutation(cells, def_.seed)(cell_cursor_++ % cells);
  const Vec3 on_surface = cell_centre(grid, cell) + particle.radius * Vec3::UnitY();

  const SinCos spread = sincos(property(def_.spread_deg, kSpread) * (kPi / 180));
  const SinCos azimuth = sincos(2 * kPi * random_.uniform(number, kAzimuth));
  const Vec3 direction(spread.sin * azimuth.cos, spread.cos, spread.sin * azimuth.sin);

  const sim::Motion carrier = def_.body ? world.body_motion(def_.body, birth) : sim::Motion{};
  particle.position = carrier.pose.point_to_world(def_.surface.pose.point_to_world(on_surface));
  particle.velocity = property(def_.speed, kSpeed) *
                          carrier.pose.vector_to_world(def_.surface.pose.vector_to_world(direction)) +
                      carrier.velocity +
                      carrier.angular_velocity.cross(particle.position - carrier.pose.position);
  world.add_particle(target_, particle, end - birth);
}

}  // namespace offstage::effects
