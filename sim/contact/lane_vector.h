#pragma once
/// Four vectors of three in the lanes of three registers: the same arithmetic for four contacts at once.

#include <immintrin.h>

#include "sim/collision/lanes.h"

namespace offstage::sim {

struct LaneVector {
  Lanes x, y, z;

  void set(int lane, const Vec3& v) { x[lane] = v.x(), y[lane] = v.y(), z[lane] = v.z(); }
};

inline LaneVector operator+(const LaneVector& a, const LaneVector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline LaneVector operator-(const LaneVector& a, const LaneVector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline LaneVector operator*(Lanes s, const LaneVector& a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline Lanes dot(const LaneVector& a, const LaneVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline LaneVector cross(const LaneVector& a, const LaneVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Four symmetric matrices of 3 x 3.
struct LaneSymmetric {
  Lanes xx, xy, xz, yy, yz, zz;

  void set(int lane, const Mat3& m) {
    xx[lane] = m(0, 0), xy[lane] = m(0, 1), xz[lane] = m(0, 2);
    yy[lane] = m(1, 1), yz[lane] = m(1, 2), zz[lane] = m(2, 2);
  }
};

inline LaneSymmetric operator+(const LaneSymmetric& a, const LaneSymmetric& b) {
  return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}
inline LaneVector operator*(const LaneSymmetric& m, const LaneVector& v) {
  return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
          m.xz * v.x + m.yz * v.y + m.zz * v.z};
}

/// Four matrices by their rows.
struct LaneMatrix {
  LaneVector x, y, z;
};
inline LaneVector operator*(const LaneMatrix& m, const LaneVector& v) {
  return {dot(m.x, v), dot(m.y, v), dot(m.z, v)};
}
/// The transposed times v.
inline LaneVector transposed_product(const LaneMatrix& m, const LaneVector& v) {
  return v.x * m.x + v.y * m.y + v.z * m.z;
}

/// The first three elements of four registers as the lanes of a vector, and back; the fourth become 0.
inline LaneVector transposed(Lanes a, Lanes b, Lanes c, Lanes d) {
  const Lanes even_ab = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  const Lanes even_cd = __builtin_shufflevector(c, d, 0, 4, 2, 6);
  const Lanes odd_ab = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Lanes odd_cd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  return {__builtin_shufflevector(even_ab, even_cd, 0, 1, 4, 5),
          __builtin_shufflevector(odd_ab, odd_cd, 0, 1, 4, 5),
          __builtin_shufflevector(even_ab, even_cd, 2, 3, 6, 7)};
}
struct LaneRows {
  Lanes a, b, c, d;
};
inline LaneRows transposed(const LaneVector& v) {
  const Lanes zero{};
  const Lanes xy_ac = __builtin_shufflevector(v.x, v.y, 0, 4, 2, 6);
  const Lanes xy_bd = __builtin_shufflevector(v.x, v.y, 1, 5, 3, 7);
  const Lanes z_ac = __builtin_shufflevector(v.z, zero, 0, 4, 2, 6);
  const Lanes z_bd = __builtin_shufflevector(v.z, zero, 1, 5, 3, 7);
  return {__builtin_shufflevector(xy_ac, z_ac, 0, 1, 4, 5), __builtin_shufflevector(xy_bd, z_bd, 0, 1, 4, 5),
          __builtin_shufflevector(xy_ac, z_ac, 2, 3, 6, 7), __builtin_shufflevector(xy_bd, z_bd, 2, 3, 6, 7)};
}

inline Lanes lanes(Real x) {
  return Lanes{x, x, x, x};
}
inline Lanes lane_min(Lanes x, Lanes y) {
  return x < y ? x : y;
}
inline Lanes lane_clamp(Lanes x, Lanes limit) {
  return lane_min(lane_max(x, -limit), limit);
}
/// 1 / x, and 0 of what is not positive.
inline Lanes lane_inverse(Lanes x) {
  return x > 0 ? 1 / x : Lanes{};
}
/// Correctly rounded, as std::sqrt.
inline Lanes lane_sqrt(Lanes x) {
  return _mm256_sqrt_pd(x);
}

}  // namespace offstage::sim
