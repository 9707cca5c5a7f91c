#pragma once
/// Private: refuses parameters that cannot be drawn from.

#include <limits>
#include <stdexcept>
#include <string>

#include "effects/distribution.h"

namespace offstage::effects {

/// What a parameter may be. Closed limits cut a distribution off (F2); an open one must be set explicitly.
struct Limits {
  Real low = -std::numeric_limits<Real>::max(), high = std::numeric_limits<Real>::max();
  bool low_open = false;  ///< `low` itself is not allowed
};

inline constexpr Limits kAnyNumber{}, kNotNegative{.low = 0}, kPositive{.low = 0, .low_open = true},
    kFraction{.low = 0, .high = 1}, kAngle{.low = -180, .high = 180};
inline constexpr Real kMaxRate = 1e9, kMaxCount = 1e9, kMinInterval = 1e-6;
inline constexpr Limits kRates{.low = 0, .high = kMaxRate}, kCounts{.low = 0, .high = kMaxCount};
inline constexpr Limits kIntervals{.low = kMinInterval, .low_open = true};

/// Throws std::invalid_argument in the name of `owner`, such as `emitter "rain"`.
void check(const std::string& owner, const char* field, const Varying& v, const Limits& limits);

/// The parameters that every newborn has.
template <class Def>
void check_particle(const std::string& owner, const Def& def) {
  check(owner, "speed", def.speed, kAnyNumber);
  check(owner, "spread_deg", def.spread_deg, kAngle);
  check(owner, "radius", def.radius, kPositive);
  check(owner, "mass", def.mass, kNotNegative);
  if (upper_bound(def.mass) <= 0) check(owner, "density", def.density, kPositive);
  check(owner, "lifespan", def.lifespan, kPositive);
  check(owner, "restitution", def.restitution, kFraction);
  check(owner, "friction", def.friction, kNotNegative);
  check(owner, "charge", def.charge, kAnyNumber);
}

}  // namespace offstage::effects
