#pragma once
/// Flat arrays of numbers as Eigen arrays, for the integrators.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "sim/core/types.h"

namespace offstage::sim {

inline Eigen::Map<Eigen::ArrayXd> array(std::span<Real> s) {
  return {s.data(), static_cast<Eigen::Index>(s.size())};
}
inline Eigen::Map<const Eigen::ArrayXd> array(std::span<const Real> s) {
  return {s.data(), static_cast<Eigen::Index>(s.size())};
}
inline Eigen::Map<Eigen::ArrayXd> array(std::vector<Real>& s) {
  return array(std::span(s));
}

/// The greatest absolute value; NaN if any element is NaN.
inline Real greatest(std::span<const Real> s) {
  Real m = 0;
  for (Real v : s) m = std::abs(v) <= m ? m : std::abs(v);
  return m;
}

}  // namespace offstage::sim
