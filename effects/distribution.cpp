#include "effects/distribution.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace offstage::effects {
namespace {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;  // Clang before 17 does not deduce it

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
/// A limit of at least this size counts as none.
constexpr Real kUnbounded = 1e300;
/// Value of the standard normal distribution function at -1.
constexpr Real kBelowOneDeviation = 0.15865525393145705;

Real value_at(const Curve& curve, Real t) {
  const auto& keys = curve.keys;
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), t, [](Real x, const auto& key) { return x < key.first; });
  if (after == keys.begin()) return keys.front().second;
  if (after == keys.end()) return keys.back().second;
  const auto& [t0, v0] = *(after - 1);
  const auto& [t1, v1] = *after;
  return v0 + (v1 - v0) * ((t - t0) / (t1 - t0));
}

/// Returns the value for a uniform random number u. A distribution that is truncated at one standard
/// deviation uses only quantiles from its middle.
Real value_at(const Normal& n, Real u) {
  const Real p = n.clip ? kBelowOneDeviation + u * (1 - 2 * kBelowOneDeviation) : u;
  return std::clamp(n.mean + n.deviation * normal_quantile(p), n.min, n.max);
}

/// Returns the bound of a normal distribution: the upper one for `sign` 1, the lower one for -1.
Real bound(const Normal& n, int sign) {
  const Real reach = n.clip || n.deviation == 0 ? n.deviation : kInfinity;
  const Real end = std::clamp(n.mean + sign * reach, n.min, n.max);
  return std::abs(end) < kUnbounded ? end : sign * kInfinity;
}

bool by_value(const std::pair<Real, Real>& a, const std::pair<Real, Real>& b) {
  return a.second < b.second;
}

}  // namespace

Real sample(const Varying& v, Real u, Real t) {
  return std::visit(Overloaded{[](Real x) { return x; }, [&](const Normal& n) { return value_at(n, u); },
                               [&](const Uniform& r) { return r.low + u * (r.high - r.low); },
                               [&](const Curve& c) { return value_at(c, t); }},
                    v);
}

Real lower_bound(const Varying& v) {
  return std::visit(Overloaded{[](Real x) { return x; }, [](const Normal& n) { return bound(n, -1); },
                               [](const Uniform& r) { return r.low; },
                               [](const Curve& c) {
                                 return std::min_element(c.keys.begin(), c.keys.end(), by_value)->second;
                               }},
                    v);
}

Real upper_bound(const Varying& v) {
  return std::visit(Overloaded{[](Real x) { return x; }, [](const Normal& n) { return bound(n, 1); },
                               [](const Uniform& r) { return r.high; },
                               [](const Curve& c) {
                                 return std::max_element(c.keys.begin(), c.keys.end(), by_value)->second;
                               }},
                    v);
}

Real mean(const Varying& v, Real t) {
  return std::visit(Overloaded{[](Real x) { return x; }, [](const Normal& n) { return n.mean; },
                               [](const Uniform& r) { return (r.low + r.high) / 2; },
                               [&](const Curve& c) { return value_at(c, t); }},
                    v);
}

}  // namespace offstage::effects
