#pragma once
/// Vectors of three numbers in one vector register, with 0 in the fourth lane. Eigen uses scalar arithmetic
/// for vectors of three numbers. Overlap tests of boxes take half the time with registers, and a query of two
/// meshes needs thousands of them. Operations and their order are the same as with scalars, so results do not
/// change.

#include <cstdint>

#include "sim/core/types.h"

namespace offstage::sim {

typedef Real Lanes __attribute__((vector_size(4 * sizeof(Real))));

inline Lanes lanes(const Vec3& v) {
  return Lanes{v[0], v[1], v[2], 0};
}
inline Lanes lane_abs(Lanes x) {
  typedef int64_t Bits __attribute__((vector_size(sizeof(Lanes))));
  return reinterpret_cast<Lanes>(reinterpret_cast<Bits>(x) & INT64_MAX);
}
inline Lanes lane_max(Lanes x, Lanes y) {
  return x > y ? x : y;
}
/// Returns (y, z, x).
inline Lanes lane_next(Lanes v) {
  return __builtin_shufflevector(v, v, 1, 2, 0, 3);
}
/// Returns (z, x, y).
inline Lanes lane_last(Lanes v) {
  return __builtin_shufflevector(v, v, 2, 0, 1, 3);
}

inline Lanes lane_cross(Lanes a, Lanes b) {
  return lane_next(a * lane_next(b) - lane_next(a) * b);
}
/// Dot product of two vectors of three, summed in the order of Eigen.
inline Real lane_dot(Lanes a, Lanes b) {
  const Lanes p = a * b;
  return p[0] + p[1] + p[2];
}
inline Vec3 vector_of(Lanes v) {
  return {v[0], v[1], v[2]};
}

/// The columns of a matrix.
struct LaneColumns {
  Lanes x, y, z;
};

inline LaneColumns columns(const Mat3& m) {
  return {lanes(m.col(0)), lanes(m.col(1)), lanes(m.col(2))};
}
inline LaneColumns lane_abs(const LaneColumns& m) {
  return {lane_abs(m.x), lane_abs(m.y), lane_abs(m.z)};
}
inline LaneColumns transposed(const LaneColumns& m) {
  const Lanes even = __builtin_shufflevector(m.x, m.y, 0, 4, 2, 6);
  const Lanes odd = __builtin_shufflevector(m.x, m.y, 1, 5, 3, 7);
  return {__builtin_shufflevector(even, m.z, 0, 1, 4, 7), __builtin_shufflevector(odd, m.z, 0, 1, 5, 7),
          __builtin_shufflevector(even, m.z, 2, 3, 6, 7)};
}
/// Matrix times vector; V is anything with three elements.
template <class V>
Lanes product(const LaneColumns& m, const V& v) {
  return m.x * v[0] + m.y * v[1] + m.z * v[2];
}
inline LaneColumns product(const LaneColumns& a, const Mat3& b) {
  return {product(a, b.col(0)), product(a, b.col(1)), product(a, b.col(2))};
}

}  // namespace offstage::sim
