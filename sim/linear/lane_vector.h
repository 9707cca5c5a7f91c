#pragma once
/// Vectors of three numbers in three registers, so that one instruction computes several contacts. A register
/// holds doubles (Lanes) or floats (FloatLanes).

#include <type_traits>

#include <immintrin.h>

#include "sim/linear/lanes.h"

namespace offstage::sim {

typedef float FloatLanes __attribute__((vector_size(8 * sizeof(float))));

template <class L>
struct LaneVector {
  L x, y, z;

  void set(unsigned lane, const Vec3& v) {
    using Scalar = std::remove_reference_t<decltype(x[0])>;
    x[lane] = static_cast<Scalar>(v.x());
    y[lane] = static_cast<Scalar>(v.y());
    z[lane] = static_cast<Scalar>(v.z());
  }
};

template <class L>
LaneVector<L> operator+(const LaneVector<L>& a, const LaneVector<L>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class L>
LaneVector<L> operator-(const LaneVector<L>& a, const LaneVector<L>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class L>
LaneVector<L> operator*(L s, const LaneVector<L>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class L>
L dot(const LaneVector<L>& a, const LaneVector<L>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class L>
LaneVector<L> cross(const LaneVector<L>& a, const LaneVector<L>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Symmetric 3 x 3 matrices.
template <class L>
struct LaneSymmetric {
  L xx, xy, xz, yy, yz, zz;

  void set(unsigned lane, const Mat3& m) {
    using Scalar = std::remove_reference_t<decltype(xx[0])>;
    xx[lane] = static_cast<Scalar>(m(0, 0));
    xy[lane] = static_cast<Scalar>(m(0, 1));
    xz[lane] = static_cast<Scalar>(m(0, 2));
    yy[lane] = static_cast<Scalar>(m(1, 1));
    yz[lane] = static_cast<Scalar>(m(1, 2));
    zz[lane] = static_cast<Scalar>(m(2, 2));
  }
};

template <class L>
LaneSymmetric<L> operator+(const LaneSymmetric<L>& a, const LaneSymmetric<L>& b) {
  return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}
template <class L>
LaneVector<L> operator*(const LaneSymmetric<L>& m, const LaneVector<L>& v) {
  return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
          m.xz * v.x + m.yz * v.y + m.zz * v.z};
}

/// 3 x 3 matrices, stored by rows.
template <class L>
struct LaneMatrix {
  LaneVector<L> x, y, z;
};
template <class L>
LaneVector<L> operator*(const LaneMatrix<L>& m, const LaneVector<L>& v) {
  return {dot(m.x, v), dot(m.y, v), dot(m.z, v)};
}
/// The transposed matrix times v.
template <class L>
LaneVector<L> transposed_product(const LaneMatrix<L>& m, const LaneVector<L>& v) {
  return v.x * m.x + v.y * m.y + v.z * m.z;
}

inline Lanes lanes(Real x) {
  return Lanes{x, x, x, x};
}
inline FloatLanes float_lanes(Real x) {
  return _mm256_set1_ps(static_cast<float>(x));
}
inline FloatLanes lane_abs(FloatLanes x) {
  return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), x);
}
inline FloatLanes lane_max(FloatLanes x, FloatLanes y) {
  return _mm256_max_ps(x, y);
}
inline FloatLanes lane_min(FloatLanes x, FloatLanes y) {
  return _mm256_min_ps(x, y);
}
inline FloatLanes lane_clamp(FloatLanes x, FloatLanes limit) {
  return lane_min(lane_max(x, -limit), limit);
}
/// Returns 1 / x, and 0 in lanes that are not positive.
inline FloatLanes lane_inverse(FloatLanes x) {
  return x > 0 ? 1 / x : FloatLanes{};
}
/// Returns the square roots of all lanes, correctly rounded as in std::sqrt().
inline Lanes lane_sqrt(Lanes x) {
  return _mm256_sqrt_pd(x);
}
inline FloatLanes lane_sqrt(FloatLanes x) {
  return _mm256_sqrt_ps(x);
}

}  // namespace offstage::sim
