#pragma once
/// Rotations between directions.

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace offstage::sim {

/// Returns the smallest rotation that turns direction `from` into direction `to`. Neither may be zero;
/// lengths do not matter. For opposite directions it is a half turn about the axis perpendicular to `from`
/// that is closest to Z (or to X, if `from` is near Z). Eigen's FromTwoVectors does the same with a singular
/// value decomposition, which takes five seconds to compile in every file that calls it.
template <typename A, typename B>
Eigen::Quaternion<typename A::Scalar> rotation_between(const Eigen::MatrixBase<A>& from,
                                                       const Eigen::MatrixBase<B>& to) {
  using Scalar = typename A::Scalar;
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  const Vector f = from.normalized(), t = to.normalized();
  const Scalar cosine = f.dot(t);
  Eigen::Quaternion<Scalar> q;
  if (cosine < -1 + Eigen::NumTraits<Scalar>::dummy_precision()) {
    const Vector near = std::abs(f.z()) < Scalar(0.9) ? Vector::UnitZ() : Vector::UnitX();
    const Scalar w2 = (1 + std::max(cosine, Scalar(-1))) / 2;
    q.w() = std::sqrt(w2);
    q.vec() = (near - near.dot(f) * f).normalized() * std::sqrt(1 - w2);
  } else {
    const Scalar s = std::sqrt((1 + cosine) * 2);
    q.vec() = f.cross(t) * (1 / s);
    q.w() = s / 2;
  }
  return q;
}

}  // namespace offstage::sim
