#pragma once
/// Vectors as the flat runs of numbers that integrators work on, and back.

#include <span>

#include "sim/core/types.h"

namespace offstage::sim {

/// The coordinates of consecutive points.
inline std::span<Real> flat(std::span<Vec3> v) {
  static_assert(sizeof(Vec3) == 3 * sizeof(Real));
  return {v.empty() ? nullptr : v.front().data(), 3 * v.size()};
}

/// Three numbers of a run as a vector.
inline Eigen::Map<Vec3> vec3(std::span<Real> s, std::size_t at) {
  return Eigen::Map<Vec3>(&s[at]);
}
inline Eigen::Map<const Vec3> vec3(std::span<const Real> s, std::size_t at) {
  return Eigen::Map<const Vec3>(&s[at]);
}

}  // namespace offstage::sim
