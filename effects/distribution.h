#pragma once
/// Parameters that vary: a constant, a normal distribution (mean and deviation, physics F2), a uniform
/// distribution, or a curve over time.

#include <utility>
#include <variant>
#include <vector>

#include "effects/random.h"

namespace offstage::effects {

/// Normal distribution, truncated at mean +- deviation unless `clip` is false; min and max always apply.
struct Normal {
  Real mean = 0;
  Real deviation = 0;  ///< >= 0
  Real min = -1e300, max = 1e300;
  bool clip = true;
};
struct Uniform {
  Real low = 0, high = 1;
};
/// A piecewise linear function of time, as pairs of time [s] and value with strictly increasing times. It is
/// constant before the first and after the last key.
struct Curve {
  std::vector<std::pair<Real, Real>> keys;
};

using Varying = std::variant<Real, Normal, Uniform, Curve>;

/// Returns the value for the quantile u in (0, 1), at the time t [s].
Real sample(const Varying& v, Real u, Real t);
/// Smallest and largest value that sample() can return; infinite for a normal distribution without clipping
/// and bounds.
Real lower_bound(const Varying& v);
Real upper_bound(const Varying& v);
/// Mean at the time t [s], before truncation.
Real mean(const Varying& v, Real t);

}  // namespace offstage::effects
