#include "sim/collision/bounding_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "sim/collision/small_hull.h"

namespace offstage::sim {
namespace {

constexpr int kDirections = kSmallHullPoints / 2;
using Heights = Eigen::Array<Real, kDirections, 1>;

/// Returns evenly distributed axes: through the vertices of an icosahedron, and through the vertices of the
/// dual dodecahedron that are not also vertices of a cube.
Eigen::Array<Real, kDirections, 3> even_directions() {
  constexpr Real kGolden = std::numbers::phi;
  Eigen::Matrix<Real, kDirections, 3> d;
  for (int k = 0, row = 0; k < 3; ++k)
    for (Real sign : {-1.0, 1.0}) {
      const Vec3 icosahedral(0, 1, sign * kGolden), dodecahedral(0, kGolden, sign / kGolden);
      for (int i = 0; i < 3; ++i) {
        d(row, (i + k) % 3) = icosahedral[i];
        d(row + 1, (i + k) % 3) = dodecahedral[i];
      }
      row += 2;
    }
  return d.rowwise().normalized();
}

/// Returns the points themselves if they are few, otherwise those that are extreme in 24 directions.
std::span<const Vec3> extreme_points(std::span<const Vec3> points, std::array<Vec3, kSmallHullPoints>& kept) {
  static const Eigen::Array<Real, kDirections, 3> directions = even_directions();
  if (points.size() <= kept.size()) return points;
  Heights low = Heights::Constant(kInfinity), high = -low;
  std::array<uint32_t, kDirections> lowest{}, highest{};
  for (uint32_t i = 0; i < points.size(); ++i) {
    const Vec3& p = points[i];
    const Heights h = directions.col(0) * p.x() + directions.col(1) * p.y() + directions.col(2) * p.z();
    if (!(h < low).any() && !(h > high).any()) continue;
    for (int k = 0; k < kDirections; ++k) {
      if (h[k] < low[k]) lowest[static_cast<std::size_t>(k)] = i;
      if (h[k] > high[k]) highest[static_cast<std::size_t>(k)] = i;
    }
    low = low.min(h);
    high = high.max(h);
  }
  for (std::size_t k = 0; k < lowest.size(); ++k) {
    kept[2 * k] = points[lowest[k]];
    kept[2 * k + 1] = points[highest[k]];
  }
  return kept;
}

/// Returns the axes of a triangle's smallest box, which has twice the triangle's area: along the longest
/// edge, and the normal.
Mat3 triangle_axes(const Vec3& p, const Vec3& q, const Vec3& r) {
  const std::array<Vec3, 3> edges = {q - p, r - q, p - r};
  const Vec3 longest = *std::max_element(edges.begin(), edges.end(), [](const Vec3& a, const Vec3& b) {
    return a.squaredNorm() < b.squaredNorm();
  });
  if (!(longest.squaredNorm() > 0)) return Mat3::Identity();
  const Vec3 normal = edges[0].cross(edges[1]);
  Mat3 axes;
  axes.col(0) = longest.normalized();
  axes.col(1) = normal.squaredNorm() > 0 ? normal.cross(longest).normalized() : axes.col(0).unitOrthogonal();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

}  // namespace

Obb fit_obb(std::span<const Vec3> points) {
  if (points.size() == 3) return fit_obb(points, triangle_axes(points[0], points[1], points[2]));
  std::array<Vec3, kSmallHullPoints> kept;
  const Mat3 covariance = hull_covariance(extreme_points(points, kept));
  Mat3 axes = Eigen::SelfAdjointEigenSolver<Mat3>(covariance).eigenvectors();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return fit_obb(points, axes);
}

Obb fit_obb(std::span<const Vec3> points, const Mat3& axes) {
  const Mat3 from_frame = axes.transpose();
  Vec3 low = Vec3::Constant(kInfinity), high = -low;
  for (const Vec3& p : points) {
    const Vec3 q = from_frame * p;
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  return {axes * ((low + high) / 2), (high - low) / 2, axes};
}

BoundingSphere fit_sphere(std::span<const Vec3> points) {
  std::array<const Vec3*, 6> extreme;
  extreme.fill(&points[0]);
  for (const Vec3& p : points)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      if (p[axis] < (*extreme[2 * k])[axis]) extreme[2 * k] = &p;
      if (p[axis] > (*extreme[2 * k + 1])[axis]) extreme[2 * k + 1] = &p;
    }
  BoundingSphere s{points[0], 0};
  for (const Vec3* a : extreme)
    for (const Vec3* b : extreme) {
      const Real radius = (*a - *b).norm() / 2;
      if (radius > s.radius) s = {(*a + *b) / 2, radius};
    }
  for (const Vec3& p : points) {
    const Real d2 = (p - s.centre).squaredNorm();
    if (d2 <= s.radius * s.radius) continue;
    // The new diameter extends from p to the far side: r' = (r + d)/2, and the centre is at the distance r'
    // from p.
    const Real d = std::sqrt(d2), radius = (s.radius + d) / 2;
    s = {(radius * s.centre + (d - radius) * p) / d, radius};
  }
  Real farthest2 = 0;
  for (const Vec3& p : points) farthest2 = std::max(farthest2, (p - s.centre).squaredNorm());
  s.radius = std::sqrt(farthest2);
  return s;
}

}  // namespace offstage::sim
