#pragma once
/// Conversion between vectors and the flat arrays of numbers that integrators use.

#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

/// Returns the coordinates of consecutive points as a flat array, without a copy.
inline std::span<Real> flat(std::span<Vec3> v) {
  static_assert(sizeof(Vec3) == 3 * sizeof(Real));
  return {v.empty() ? nullptr : v.front().data(), 3 * v.size()};
}

/// Returns three numbers of a flat array, from index `at` on, as a vector, without a copy.
inline Eigen::Map<Vec3> vec3(std::span<Real> s, std::size_t at) {
  return Eigen::Map<Vec3>(&s[at]);
}
inline Eigen::Map<const Vec3> vec3(std::span<const Real> s, std::size_t at) {
  return Eigen::Map<const Vec3>(&s[at]);
}

}  // namespace offstage::sim
