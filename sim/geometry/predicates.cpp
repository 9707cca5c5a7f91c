#include "sim/geometry/predicates.h"

#include <array>
#include <cmath>
#include <limits>

namespace offstage::sim {
namespace {

constexpr Real kHalfUlp = std::numeric_limits<Real>::epsilon() / 2;
// Bounds of the rounding error of the determinants of differences, relative to the sum of the absolute values
// of their terms (Shewchuk 1997, section 4).
constexpr Real kError3d = (7 + 56 * kHalfUlp) * kHalfUlp, kError2d = (3 + 16 * kHalfUlp) * kHalfUlp;

/// An exact sum as components of increasing size that do not overlap, so the last one has the sign of the
/// sum.
class Expansion {
 public:
  void add(Real x) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const Real sum = x + part_[i], virtual_part = sum - x;
      const Real error = (x - (sum - virtual_part)) + (part_[i] - virtual_part);
      if (error != 0) part_[kept++] = error;
      x = sum;
    }
    if (x != 0) part_[kept++] = x;
    size_ = kept;
  }
  void add_product(Real x, Real y) {
    const Real product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  }
  void add_product(Real x, Real y, Real z) {
    const Real product = x * y;
    add_product(std::fma(x, y, -product), z);
    add_product(product, z);
  }
  Real value() const { return size_ > 0 ? part_[size_ - 1] : 0; }

 private:
  std::array<Real, 96> part_;  // four components for each of the 24 products of orient3d
  std::size_t size_ = 0;
};

void add_determinant(Expansion& sum, Real sign, const Vec3& a, const Vec3& b, const Vec3& c) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    sum.add_product(sign * a[i], b[j], c[k]);
    sum.add_product(-sign * a[i], b[k], c[j]);
  }
}

Real exact_orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  Expansion sum;
  add_determinant(sum, 1, b, c, d);
  add_determinant(sum, -1, a, c, d);
  add_determinant(sum, 1, a, b, d);
  add_determinant(sum, -1, a, b, c);
  return sum.value();
}

}  // namespace

OrientedPlane::OrientedPlane(const Vec3& a, const Vec3& b, const Vec3& c) : a_(a), b_(b), c_(c) {
  const Vec3 u = b - a, v = c - a;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const Real plus = u[j] * v[k], minus = u[k] * v[j];
    normal_[i] = plus - minus;
    magnitude_[i] = std::abs(plus) + std::abs(minus);
  }
}

Real OrientedPlane::side(const Vec3& d) const {
  const Vec3 w = d - a_;
  const Real value = normal_.dot(w);
  if (std::abs(value) > kError3d * magnitude_.dot(w.cwiseAbs())) return value;
  return exact_orient3d(a_, b_, c_, d);
}

Real orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return OrientedPlane(a, b, c).side(d);
}

Real orient2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const Real left = (b.x() - a.x()) * (c.y() - a.y()), right = (b.y() - a.y()) * (c.x() - a.x());
  const Real value = left - right;
  if (std::abs(value) > kError2d * (std::abs(left) + std::abs(right))) return value;
  Expansion sum;
  for (const auto& [p, q] : {std::pair(&a, &b), std::pair(&b, &c), std::pair(&c, &a)}) {
    sum.add_product(p->x(), q->y());
    sum.add_product(-p->y(), q->x());
  }
  return sum.value();
}

}  // namespace offstage::sim
