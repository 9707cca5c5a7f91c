#include "effects/schedule.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "effects/limits.h"
#include "effects/particle_draws.h"

namespace offstage::effects {
namespace {

constexpr Real kNever = std::numeric_limits<Real>::infinity();
/// Time for which a random rate keeps its value [s].
constexpr Real kRateWindow = 0.1;
/// If this many consecutive windows (almost three hours) have no particle, a random rate counts as zero from
/// then on.
constexpr int kMaxIdleWindows = 100'000;

/// Returns the time at which the integral of a rate over time, starting at t, reaches 1 [s].
Real curve_birth_time(const Varying& rate, const Curve& curve, Real t) {
  const auto at = [&](Real time) { return std::max(0.0, sample(rate, 0.5, time)); };
  Real need = 1;
  for (const auto& [key, value] : curve.keys) {
    if (key <= t) continue;
    const Real span = key - t, r0 = at(t), slope = (std::max(0.0, value) - r0) / span;
    const Real area = (r0 + slope * span / 2) * span;
    // Solves r0 s + slope s^2 / 2 = need, in the form that is also valid for slope = 0 or r0 = 0.
    if (area >= need) return t + 2 * need / (r0 + std::sqrt(std::max(0.0, r0 * r0 + 2 * slope * need)));
    need -= area;
    t = key;
  }
  const Real held = at(t);
  return held > 0 ? t + need / held : kNever;
}

}  // namespace

Schedule::Schedule(const EmitterDef& def, Real origin)
    : rate_(def.release.rate),
      count_(def.release.count),
      interval_(def.release.interval),
      bursts_(def.release.bursts),
      windows_(def.release.windows),
      random_(def.seed, stream_id(def.name)),
      origin_(origin),
      start_(origin + (def.release.start - def.release.prewarm)),
      end_(origin + def.release.end),
      burst_cycles_(def.release.bursts.size(), 0) {
  next_single_ = next_birth_time(start_);
  next_periodic_ = upper_bound(def.release.count) >= 0.5 ? start_ : kNever;
}

Real Schedule::draw(const Varying& v, uint64_t number, uint32_t property, Real time) const {
  return Draws(random_, number, time - origin_)(v, property);
}

bool Schedule::open(Real time) const {
  return windows_.empty() || std::any_of(windows_.begin(), windows_.end(), [&](const TimeWindow& w) {
           return origin_ + w.start <= time && time < origin_ + w.end;
         });
}

/// Returns the time of the next particle after the particle at the time `last`, according to the rate [s].
Real Schedule::next_birth_time(Real last) {
  if (const auto* constant = std::get_if<Real>(&rate_))
    return *constant > 0 ? start_ + static_cast<Real>(singles_ + 1) / *constant : kNever;
  if (const auto* curve = std::get_if<Curve>(&rate_))
    return origin_ + curve_birth_time(rate_, *curve, last - origin_);
  Real need = 1, t = last;
  for (int idle = 0; idle < kMaxIdleWindows; ++idle) {
    const Real window_end = start_ + static_cast<Real>(rate_window_ + 1) * kRateWindow;
    const Real rate = std::clamp(draw(rate_, rate_window_, kRate, t), 0.0, kMaxRate);
    if (rate * (window_end - t) >= need) return t + need / rate;
    need -= rate * (window_end - t);
    t = window_end;
    ++rate_window_;
  }
  return kNever;
}

void Schedule::collect_singles(Real end, std::vector<Release>& due) {
  for (; next_single_ <= end; next_single_ = next_birth_time(next_single_)) {
    ++singles_;
    if (open(next_single_)) due.push_back({next_single_, 1});
  }
}

void Schedule::collect_periodic(Real end, std::vector<Release>& due) {
  while (next_periodic_ <= end) {
    if (open(next_periodic_))
      due.push_back({next_periodic_, rounded(draw(count_, periodic_, kCount, next_periodic_)), true});
    ++periodic_;
    const auto* constant = std::get_if<Real>(&interval_);
    next_periodic_ = constant ? start_ + static_cast<Real>(periodic_) * *constant
                              : next_periodic_ + draw(interval_, periodic_, kInterval, next_periodic_);
  }
}

void Schedule::collect_bursts(Real end, std::vector<Release>& due) {
  for (std::size_t i = 0; i < bursts_.size(); ++i) {
    const Burst& b = bursts_[i];
    for (uint64_t& cycle = burst_cycles_[i]; cycle < static_cast<uint64_t>(b.cycles); ++cycle) {
      const Real time = origin_ + b.time + static_cast<Real>(cycle) * b.interval;
      if (time > end) break;
      due.push_back({time, rounded(draw(b.count, cycle, kBurst + static_cast<uint32_t>(i), time)), true});
    }
  }
}

void Schedule::collect(Real end, std::vector<Release>& due) {
  const Real last = std::min(end, end_);
  collect_singles(last, due);
  collect_periodic(last, due);
  collect_bursts(last, due);
}

}  // namespace offstage::effects
