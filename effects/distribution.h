#pragma once
/// Varying values: constant, normal (mean and deviation, F2), uniform, or a curve over time.

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
/// Piecewise linear over time [s], constant beyond the ends; times are strictly increasing.
struct Curve {
  std::vector<std::pair<Real, Real>> keys;
};

using Varying = std::variant<Real, Normal, Uniform, Curve>;

/// The value at quantile u in (0, 1) and time t.
Real sample(const Varying& v, Real u, Real t);
/// Smallest and largest value that sample() can return; infinite for a normal distribution without clipping
/// and bounds.
Real lower_bound(const Varying& v);
Real upper_bound(const Varying& v);
/// Mean at time t, before truncation.
Real mean(const Varying& v, Real t);

}  // namespace offstage::effects
