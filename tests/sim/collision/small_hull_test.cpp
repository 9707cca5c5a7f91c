#include "sim/collision/small_hull.h"

#include <vector>

#include <gtest/gtest.h>

#include "sim/geometry/convex_hull.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

/// Returns the covariance by the formula in the specification, summed over the triangles of Qhull's hull.
Mat3 covariance_of_hull(std::span<const Vec3> points) {
  const TriangleMesh hull = convex_hull(points).triangles();
  Real area = 0;
  Vec3 mean = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  for (const auto& [a, b, c] : hull.triangles) {
    const Vec3 &p = hull.vertices[a], &q = hull.vertices[b], &r = hull.vertices[c], m = (p + q + r) / 3;
    const Real A = (q - p).cross(r - p).norm() / 2;
    area += A;
    mean += A * m;
    second += A / 12 * (9 * m * m.transpose() + p * p.transpose() + q * q.transpose() + r * r.transpose());
  }
  mean /= area;
  return second / area - mean * mean.transpose();
}

std::vector<Vec3> random_points(uint64_t i, std::size_t count, const Vec3& size) {
  const Scatter random{9};
  std::vector<Vec3> points;
  for (uint64_t k = 0; k < count; ++k)
    points.push_back(size.cwiseProduct(
        Vec3(random.uniform(i, 3 * k), random.uniform(i, 3 * k + 1), random.uniform(i, 3 * k + 2))));
  return points;
}

TEST(SmallHull, CovarianceIsThatOfQhullsHull) {
  for (uint64_t i = 0; i < 300; ++i) {
    const auto points = random_points(i, 4 + i % 17, Vec3(3, 1, 0.2));
    ASSERT_LT((hull_covariance(points) - covariance_of_hull(points)).norm(), 1e-12) << i;
  }
}

TEST(SmallHull, CovarianceOfAFlatSetIsThatOfItsPolygon) {
  const Mat3 turn = Quat(0.9, -0.3, 0.4, 0.2).normalized().toRotationMatrix();
  for (uint64_t i = 0; i < 100; ++i) {
    auto points = random_points(i, 3 + i % 17, Vec3(3, 1, 0));
    for (Vec3& p : points) p = turn * p;
    ASSERT_LT((hull_covariance(points) - covariance_of_hull(points)).norm(), 1e-9) << i;
  }
}

TEST(SmallHull, CovarianceOfAStraightSetPointsAlongIt) {
  const std::vector<Vec3> points = {{1, 1, 1}, {2, 2, 3}, {5, 5, 9}, {5, 5, 9}};
  const Vec3 along = Vec3(1, 1, 2).normalized();
  const Mat3 c = hull_covariance(points);
  EXPECT_LT((c * along - along * c.trace()).norm(), 1e-12);
  EXPECT_GT(c.trace(), 0);
  EXPECT_EQ(hull_covariance(std::vector<Vec3>(5, Vec3(1, 2, 3))), Mat3::Zero());
}

}  // namespace
}  // namespace offstage::sim
