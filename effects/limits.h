#pragma once
/// Private: checks that parameters are in their allowed ranges.

#include <limits>
#include <stdexcept>
#include <string>

#include "effects/distribution.h"
#include "effects/new_particles.h"

namespace offstage::effects {

/// Allowed range of a parameter. A closed limit truncates a distribution (F2). A distribution that can reach
/// an open limit is an error, unless its own `min` or `max` excludes the limit.
struct Limits {
  Real low = -std::numeric_limits<Real>::max(), high = std::numeric_limits<Real>::max();
  bool low_open = false;  ///< whether `low` itself is not allowed
};

inline constexpr Limits kAnyNumber{}, kNotNegative{.low = 0}, kPositive{.low = 0, .low_open = true},
    kFraction{.low = 0, .high = 1}, kAngle{.low = -180, .high = 180};
inline constexpr Real kMaxRate = 1e9, kMaxCount = 1e9, kMinInterval = 1e-6;
inline constexpr Limits kRates{.low = 0, .high = kMaxRate}, kCounts{.low = 0, .high = kMaxCount};
inline constexpr Limits kIntervals{.low = kMinInterval, .low_open = true};

/// Throws std::invalid_argument if a value is not allowed. `owner` is the beginning of the message, for
/// example `emitter "rain"`.
void check(const std::string& owner, const char* field, const Varying& v, const Limits& limits);

/// Checks the parameters that all new particles have.
inline void check_particles(const std::string& owner, const NewParticles& particles) {
  check(owner, "speed", particles.speed, kAnyNumber);
  check(owner, "spread_deg", particles.spread_deg, kAngle);
  check(owner, "radius", particles.radius, kPositive);
  check(owner, "mass", particles.mass, kNotNegative);
  if (upper_bound(particles.mass) <= 0) check(owner, "density", particles.density, kPositive);
  check(owner, "lifespan", particles.lifespan, kPositive);
  check(owner, "restitution", particles.restitution, kFraction);
  check(owner, "friction", particles.friction, kNotNegative);
  check(owner, "charge", particles.charge, kAnyNumber);
}

}  // namespace offstage::effects
