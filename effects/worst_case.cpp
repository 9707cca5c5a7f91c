#include "effects/worst_case.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "effects/limits.h"
#include "effects/particle_draws.h"

namespace offstage::effects {
namespace {

/// All integers up to this number are exact. Larger bounds are clamped to it.
constexpr Real kSaturated = 0x1p53;
/// This replaces infinity, because infinity times zero is not a number.
constexpr Real kHuge = 1e300;
constexpr Real kEver = std::numeric_limits<Real>::infinity();

uint64_t saturated(Real x) {
  return x < kSaturated ? static_cast<uint64_t>(std::max(0.0, x)) : std::numeric_limits<uint64_t>::max();
}

Real most(const Varying& count) {
  return static_cast<Real>(rounded(upper_bound(count)));
}

// Rounds up. A quotient within rounding of an integer gives this integer.
Real up(Real x) {
  return std::ceil(x * (1 - 1e-12));
}
Real down(Real x) {
  return std::floor(x * (1 + 1e-12));
}

Real highest_rate(const Varying& rate) {
  return std::clamp(upper_bound(rate), 0.0, kMaxRate);
}

/// Returns the greatest number of particles that are released between `start` and `end` within any interval
/// of the length `window` [s]. Both ends of the interval are included, because rounding may make an age,
/// which is a sum of sub-steps, slightly less than the lifespan.
Real most_released(const EmitterDef& def, Real start, Real end, Real window) {
  const Real rate = highest_rate(def.release.rate), interval = lower_bound(def.release.interval),
             length = end - start;
  Real sum = 0;
  if (length >= 0)
    sum += (rate > 0 ? std::min(down(rate * window) + 1, down(rate * length)) : 0) +
           most(def.release.count) * (std::min(down(window / interval), down(length / interval)) + 1);
  for (const Burst& b : def.release.bursts) {
    if (b.time > end) continue;
    const Real in_run = std::min<Real>(b.cycles, down((end - b.time) / b.interval) + 1);
    sum += most(b.count) * std::min(in_run, down(window / b.interval) + 1);
  }
  return sum;
}

Real largest_release(const EmitterDef& def) {
  Real count = std::max(1.0, most(def.release.count));
  for (const Burst& b : def.release.bursts) count = std::max(count, most(b.count));
  return count;
}

/// Whether particles may be postponed because there is no room. For a mesh this is hard to determine, so the
/// result is true.
bool can_wait(const EmitterDef& def) {
  if (def.release.overlap) return false;
  const ReleaseSurface surface(def.surface);
  const Real radius = upper_bound(def.particles.radius), count = largest_release(def);
  if (count <= 1) return false;
  return !surface.has_cells() || std::isinf(radius) ||
         count > static_cast<Real>(surface.cells(2 * radius).count());
}

/// Returns the number of particles that descend from one particle, itself included. The particle may still
/// split `left` times. `own` of these splits fit into its lifespan; `each` splits fit into the lifespan of a
/// child.
Real family(Real children, int left, int own, int each) {
  // By splits left: the number for a child at the start of its life. Smaller depths are computed first.
  std::vector<std::vector<Real>> size(static_cast<std::size_t>(left) + 1);
  const int most_own = std::min(left, std::max(own, each));
  for (int d = 0; d <= left; ++d) {
    auto& row = size[static_cast<std::size_t>(d)];
    row.assign(static_cast<std::size_t>(most_own) + 1, 1.0);
    if (d == 0) continue;
    const auto& before = size[static_cast<std::size_t>(d) - 1];
    for (std::size_t j = 1; j < row.size(); ++j)
      row[j] = std::min(
          kHuge, before[j - 1] + children * before[static_cast<std::size_t>(std::min(each, most_own))]);
  }
  return size.back()[static_cast<std::size_t>(std::min(own, most_own))];
}

/// Bounds `alive` by the particles created within a lifespan, and by the limits of the system and the run.
WorstCase bounded(Real born, Real lifespan, Real at_once, Real rate, uint64_t max_alive) {
  const Real alive = std::min(born, std::ceil(at_once + (rate > 0 ? rate * lifespan : 0)));
  return {saturated(born), std::min(saturated(alive), max_alive), lifespan, at_once, rate};
}

/// Returns the bound if each parent creates `children` particles, all within the time `after` its own
/// creation [s].
WorstCase bounded_children(const WorstCase& parents, Real children, Real after, Real lifespan,
                           uint64_t max_alive) {
  const Real at_once = parents.at_once + (parents.rate > 0 ? parents.rate * after : 0);
  return bounded(static_cast<Real>(parents.born) * children, lifespan, children * at_once,
                 children * parents.rate, max_alive);
}

}  // namespace

WorstCase worst_case(const EmitterDef& def, Real duration) {
  const Real start = def.release.start - def.release.prewarm, end = std::min(def.release.end, duration);
  const Real lifespan = upper_bound(def.particles.lifespan), born = most_released(def, start, end, kEver);
  // Postponed particles may be released together with later ones.
  if (can_wait(def)) return bounded(born, lifespan, born, 0, def.particles.max_alive);
  Real at_once = 1 + most(def.release.count),
       rate = highest_rate(def.release.rate) + most(def.release.count) / lower_bound(def.release.interval);
  for (const Burst& b : def.release.bursts) {
    at_once += most(b.count);
    if (b.cycles > 1) rate += most(b.count) / b.interval;
  }
  WorstCase all = bounded(born, lifespan, at_once, rate, def.particles.max_alive);
  all.alive = std::min(saturated(most_released(def, start, end, lifespan)), def.particles.max_alive);
  return all;
}

WorstCase worst_case(const SplitDef& def, const WorstCase& parents, bool same_system) {
  if (!def.enabled) return {};
  const Real first = lower_bound(def.age), delay = lower_bound(def.delay);
  // Number of splits within a lifespan. The first split is at `first`; the others follow at intervals of
  // `delay`.
  const auto splits_in = [&](Real life) {
    return life > first ? static_cast<int>(std::min<Real>(def.depth, up((life - first) / delay))) : 0;
  };
  const Real shrink = upper_bound(def.lifespan_percent) / 100, count = most(def.count);
  const int own = splits_in(parents.lifespan);
  if (!same_system)
    return bounded_children(parents, count * own, parents.lifespan, shrink * parents.lifespan, def.max_alive);
  const int each = shrink <= 1 ? splits_in(shrink * parents.lifespan) : def.depth;
  const Real lifespan = parents.lifespan * std::pow(std::max(1.0, shrink), def.depth);
  return bounded_children(parents, family(count, def.depth, own, each) - 1, def.depth * lifespan, lifespan,
                          def.max_alive);
}

WorstCase worst_case(const TrailDef& def, const WorstCase& parents) {
  const Real rate = highest_rate(def.release.rate),
             time = std::min(parents.lifespan, def.release.end_age) - def.release.start_age;
  if (!(time > 0)) return {};
  // Each parent releases particles at regular times. The first one may come at once.
  const WorstCase begun = bounded_children(parents, 1, parents.lifespan, 0, def.particles.max_alive);
  return bounded(static_cast<Real>(parents.born) * up(rate * time), upper_bound(def.particles.lifespan),
                 begun.at_once, begun.rate + static_cast<Real>(parents.alive) * rate,
                 def.particles.max_alive);
}

WorstCase worst_case(const SubEmitterDef& def, const WorstCase& parents, Real hits_per_parent) {
  const Real events =
      def.release.probability > 0 ? (def.trigger == Trigger::collision ? hits_per_parent : 1) : 0;
  return bounded_children(parents, events * most(def.release.count), parents.lifespan,
                          upper_bound(def.particles.lifespan), def.particles.max_alive);
}

Real highest_clear_rate(const EmitterDef& def) {
  const ReleaseSurface surface(def.surface);
  const Real diameter = 2 * upper_bound(def.particles.radius);
  const Real slowest = std::max({0.0, lower_bound(def.particles.speed), -upper_bound(def.particles.speed)});
  if (!surface.has_cells() || std::isinf(diameter)) return 0;
  return static_cast<Real>(surface.cells(diameter).count()) * slowest / diameter;
}

}  // namespace offstage::effects
