#pragma once
/// Vectors of four points in three registers, by x, y and z, from points that are stored as x y z 0.

#include <array>
#include <cstdint>

#include <immintrin.h>

#include "sim/cloth/cloth_points.h"
#include "sim/linear/lanes.h"

namespace offstage::sim {

struct FourVectors {
  Lanes x, y, z;

  FourVectors operator-(const FourVectors& b) const { return {x - b.x, y - b.y, z - b.z}; }
  FourVectors operator+(const FourVectors& b) const { return {x + b.x, y + b.y, z + b.z}; }
  FourVectors operator*(Lanes s) const { return {s * x, s * y, s * z}; }
  Lanes dot(const FourVectors& b) const { return x * b.x + y * b.y + z * b.z; }

  FourVectors cross(const FourVectors& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }

  /// Returns the vectors of the four points with these indices.
  static FourVectors of(const Vec4* points, const std::array<uint32_t, 4>& at) {
    const auto load = [&](std::size_t k) -> Lanes { return _mm256_load_pd(points[at[k]].data()); };
    const Lanes a = load(0), b = load(1), c = load(2), d = load(3);
    const Lanes ab = __builtin_shufflevector(a, b, 0, 4, 2, 6),
                cd = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    const Lanes aby = __builtin_shufflevector(a, b, 1, 5, 3, 7),
                cdy = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    return {__builtin_shufflevector(ab, cd, 0, 1, 4, 5), __builtin_shufflevector(aby, cdy, 0, 1, 4, 5),
            __builtin_shufflevector(ab, cd, 2, 3, 6, 7)};
  }
  /// Returns the four vectors, each as x y z 0.
  std::array<Lanes, 4> apart() const {
    const Lanes none = {};
    const Lanes xy0 = __builtin_shufflevector(x, y, 0, 4, 2, 6),
                xy1 = __builtin_shufflevector(x, y, 1, 5, 3, 7);
    const Lanes z0 = __builtin_shufflevector(z, none, 0, 4, 2, 6),
                z1 = __builtin_shufflevector(z, none, 1, 5, 3, 7);
    return {__builtin_shufflevector(xy0, z0, 0, 1, 4, 5), __builtin_shufflevector(xy1, z1, 0, 1, 4, 5),
            __builtin_shufflevector(xy0, z0, 2, 3, 6, 7), __builtin_shufflevector(xy1, z1, 2, 3, 6, 7)};
  }
};

inline Lanes lane_root(Lanes v) {
  return _mm256_sqrt_pd(v);
}

}  // namespace offstage::sim
