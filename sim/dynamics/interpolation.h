#pragma once
/// Interpolation between keys over time, for poses, cameras, hands and motors.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "sim/core/types.h"

namespace offstage::sim {

/// Shape of the curve between two keys.
enum class Interpolation : uint8_t {
  /// Cubic Hermite with limited tangents: each component stays between the values of its two keys, and is
  /// constant if both are equal.
  monotone,
  smooth,  ///< cubic Hermite with Catmull-Rom tangents: smoother, but may overshoot the keys
  linear,  ///< constant velocity
  step,    ///< holds the first key's value and jumps at the second key
};

/// A key of a curve: N numbers at a time, with the interpolation to the next key.
template <int N>
struct CurveKey {
  Real time;  ///< [s]
  Eigen::Array<Real, N, 1> value;
  Interpolation interpolation = Interpolation::monotone;
};

/// A value and its time derivative.
template <int N>
struct CurveSample {
  Eigen::Array<Real, N, 1> value = Eigen::Array<Real, N, 1>::Zero();
  Eigen::Array<Real, N, 1> rate = Eigen::Array<Real, N, 1>::Zero();
};

/// Returns the tangent at a key between two segments, which have the mean rates `before` and `after` and the
/// durations h0 and h1. It is the tangent of the parabola through the three keys (Catmull-Rom for non-uniform
/// times). If `limited`, each component is zero at an extremum, and otherwise at most three times the smaller
/// mean rate, so that the cubic is monotone (de Boor and Swartz 1977; Fritsch and Carlson 1980).
template <int N>
Eigen::Array<Real, N, 1> key_tangent(const Eigen::Array<Real, N, 1>& before, Real h0,
                                     const Eigen::Array<Real, N, 1>& after, Real h1, bool limited) {
  Eigen::Array<Real, N, 1> tangent = (h1 * before + h0 * after) / (h0 + h1);
  if (!limited) return tangent;
  for (Eigen::Index k = 0; k < N; ++k) {
    const Real most = before[k] * after[k] > 0 ? 3 * std::min(std::abs(before[k]), std::abs(after[k])) : 0;
    tangent[k] = std::clamp(tangent[k], -most, most);
  }
  return tangent;
}

/// Returns value and rate of a curve at time t in segment i, between the keys i and i + 1. `count`: number of
/// keys; `key(i)` returns a CurveKey<N>. At an end of the curve the tangent is the segment's mean rate,
/// unless `loop`: the curve is then periodic.
template <int N, class Key>
CurveSample<N> sample_segment(std::size_t count, Key&& key, bool loop, std::size_t i, Real t) {
  using Value = Eigen::Array<Real, N, 1>;
  const CurveKey<N> a = key(i), b = key(i + 1);
  const Real span = b.time - a.time, s = (t - a.time) / span;
  if (a.interpolation == Interpolation::step) return {a.value, Value::Zero()};
  const Value mean = (b.value - a.value) / span;
  if (a.interpolation == Interpolation::linear) return {a.value + (t - a.time) * mean, mean};

  const bool limited = a.interpolation == Interpolation::monotone;
  const std::size_t segments = count - 1;
  // A jump has no rate, so the curves before and after it end and start at rest.
  const auto rate = [&](std::size_t segment) -> Value {
    const CurveKey<N> from = key(segment), to = key(segment + 1);
    if (from.interpolation == Interpolation::step) return Value::Zero();
    return (to.value - from.value) / (to.time - from.time);
  };
  const auto duration = [&](std::size_t segment) { return key(segment + 1).time - key(segment).time; };
  const auto tangent = [&](std::size_t before, std::size_t after) {
    return key_tangent<N>(rate(before), duration(before), rate(after), duration(after), limited);
  };
  const Value m0 = i > 0 || loop ? tangent((i + segments - 1) % segments, i) : mean;
  const Value m1 = i + 1 < segments || loop ? tangent(i, (i + 1) % segments) : mean;
  const Real s2 = s * s, s3 = s2 * s;
  // In this form the result is exactly a.value if both values are equal.
  return {a.value + (3 * s2 - 2 * s3) * (b.value - a.value) + (s3 - 2 * s2 + s) * span * m0 +
              (s3 - s2) * span * m1,
          (6 * s2 - 6 * s) / span * (a.value - b.value) + (3 * s2 - 4 * s + 1) * m0 + (3 * s2 - 2 * s) * m1};
}

/// Returns the index of the segment that contains the time t, which must be between the first and the last
/// key. `time(i)` returns the time of key i.
template <class Time>
std::size_t segment_at(std::size_t count, Time&& time, Real t) {
  std::size_t low = 0, high = count - 1;  // time(low) <= t < time(high)
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (time(middle) <= t ? low : high) = middle;
  }
  return low;
}

}  // namespace offstage::sim
