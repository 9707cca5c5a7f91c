#include "sim/collision/small_hull.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace offstage::sim {
namespace {

/// A hull of triangles that grows from a tetrahedron, point by point.
class SmallHull {
 public:
  struct Face {
    std::array<uint32_t, 3> v;
    Vec3 normal;
    Real length;  ///< length of the normal: twice the area
  };

  explicit SmallHull(std::span<const Vec3> points);

  std::span<const Face> faces() const { return {faces_.data(), static_cast<std::size_t>(face_count_)}; }
  /// Point i relative to the first of the given points.
  const Vec3& point(uint32_t i) const { return points_[i]; }
  /// Returns the vector between two distant points. If there are no faces, it is the only result.
  const Vec3& diameter() const { return diameter_; }

 private:
  /// Returns the point with the largest f(point), and this value.
  template <class F>
  std::pair<uint32_t, Real> farthest(F&& f) const;
  void grow_from(uint32_t a, uint32_t b, uint32_t c);
  void add_face(uint32_t a, uint32_t b, uint32_t c);
  void add_point(uint32_t p);

  static constexpr std::size_t kCapacity = kSmallHullPoints + 2;  // with the two apexes of a flat set
  static constexpr std::ptrdiff_t kMaxFaces = 2 * kCapacity;

  std::array<Vec3, kCapacity> points_;
  std::array<Face, kMaxFaces> faces_;
  Vec3 diameter_;
  uint32_t point_count_ = 1;
  std::ptrdiff_t face_count_ = 0;
};

SmallHull::SmallHull(std::span<const Vec3> points) {
  assert(!points.empty() && points.size() <= kSmallHullPoints);
  points_[0] = Vec3::Zero();
  while (point_count_ < points.size()) {
    points_[point_count_] = points[point_count_] - points[0];
    ++point_count_;
  }
  const uint32_t a = farthest([](const Vec3& p) { return p.squaredNorm(); }).first;
  const uint32_t b = farthest([&](const Vec3& p) { return (p - points_[a]).squaredNorm(); }).first;
  diameter_ = points_[b] - points_[a];
  const auto [c, area] = farthest([&](const Vec3& p) { return diameter_.cross(p - points_[a]).norm(); });
  constexpr Real kStraight = 1e-9;
  if (area > kStraight * diameter_.squaredNorm()) grow_from(a, b, c);
}

template <class F>
std::pair<uint32_t, Real> SmallHull::farthest(F&& f) const {
  std::pair<uint32_t, Real> best = {0, f(points_[0])};
  for (uint32_t i = 1; i < point_count_; ++i)
    if (const Real x = f(points_[i]); x > best.second) best = {i, x};
  return best;
}

/// Starts with the triangle a, b, c and the point that is farthest from its plane.
void SmallHull::grow_from(uint32_t a, uint32_t b, uint32_t c) {
  const Vec3 normal = diameter_.cross(points_[c] - points_[a]).normalized();
  const auto height = [&](const Vec3& p) { return normal.dot(p - points_[a]); };
  auto [d, most] = farthest([&](const Vec3& p) { return std::abs(height(p)); });
  // A flat set of points gets an additional point on each side, so near to the plane that the result does not
  // change.
  constexpr Real kFlat = 1e-9, kApex = 1e-6;
  if (most <= kFlat * diameter_.norm()) {
    const Vec3 middle = (points_[a] + points_[b] + points_[c]) / 3, up = kApex * diameter_.norm() * normal;
    d = point_count_;
    points_[point_count_++] = middle + up;
    points_[point_count_++] = middle - up;
  }
  if (height(points_[d]) > 0) std::swap(b, c);
  add_face(a, b, c);
  add_face(a, c, d);
  add_face(c, b, d);
  add_face(b, a, d);
  for (uint32_t p = 0; p < point_count_; ++p) add_point(p);
}

void SmallHull::add_face(uint32_t a, uint32_t b, uint32_t c) {
  if (face_count_ == kMaxFaces) return;
  const Vec3 normal = (points_[b] - points_[a]).cross(points_[c] - points_[a]);
  faces_[static_cast<std::size_t>(face_count_++)] = {{a, b, c}, normal, normal.norm()};
}

/// Replaces the faces that are visible from p by faces that connect their outline with p.
void SmallHull::add_point(uint32_t p) {
  const Real rounding = 1e-12 * diameter_.norm();
  const auto seen = std::partition(faces_.begin(), faces_.begin() + face_count_, [&](const Face& f) {
    return f.normal.dot(points_[p] - points_[f.v[0]]) <= rounding * f.length;
  });
  static_assert(kCapacity <= 32);
  std::array<uint32_t, kCapacity> heads{};  // Bit j of heads[i]: an edge from i to j bounds a visible face.
  std::array<std::pair<uint32_t, uint32_t>, 3 * kMaxFaces> edges;
  std::size_t edge_count = 0;
  for (auto f = seen; f != faces_.begin() + face_count_; ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [tail, head] = edges[edge_count++] = {f->v[k], f->v[(k + 1) % 3]};
      heads[tail] |= 1u << head;
    }
  face_count_ = seen - faces_.begin();
  for (std::size_t e = 0; e < edge_count; ++e)
    if (const auto [tail, head] = edges[e]; !(heads[head] >> tail & 1)) add_face(tail, head, p);
}

/// Returns the covariance of a triangle about its centre, per unit of area.
Mat3 triangle_covariance(const Vec3& p, const Vec3& q, const Vec3& r) {
  const Vec3 middle = (p + q + r) / 3, u = p - middle, v = q - middle, w = r - middle;
  return (u * u.transpose() + v * v.transpose() + w * w.transpose()) / 12;
}

}  // namespace

Mat3 hull_covariance(std::span<const Vec3> points) {
  const SmallHull hull(points);
  if (hull.faces().empty()) return hull.diameter() * hull.diameter().transpose();
  Mat3 second = Mat3::Zero();
  Vec3 first = Vec3::Zero();
  Real area = 0;
  for (const auto& [v, normal, weight] : hull.faces()) {
    const Vec3 &p = hull.point(v[0]), &q = hull.point(v[1]), &r = hull.point(v[2]);
    const Vec3 middle = (p + q + r) / 3;
    second += weight * (triangle_covariance(p, q, r) + middle * middle.transpose());
    first += weight * middle;
    area += weight;
  }
  return second / area - first * first.transpose() / (area * area);
}

}  // namespace offstage::sim
