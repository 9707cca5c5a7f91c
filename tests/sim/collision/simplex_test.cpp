#include "sim/collision/simplex.h"

#include <cmath>

#include <gtest/gtest.h>

#include "convex_samples.h"

namespace offstage::sim {
namespace {

Simplex simplex_of(std::initializer_list<Vec3> points) {
  Simplex s;
  for (const Vec3& w : points) s.points[s.size++] = {w, w, {}};
  return s;
}

// No vertex of the simplex is lower in the direction of the nearest point, and the weights are non-negative
// and sum to one.
TEST(NearestPoint, SupportsItsSimplex) {
  Dice dice(1);
  for (int i = 0; i < 20'000; ++i) {
    Simplex s = simplex_of({dice.in_cube(), dice.in_cube(), dice.in_cube(), dice.in_cube()});
    s.size = 1 + dice.index(4);
    const Vec3 shift = 0.7 * dice.in_cube();
    for (std::size_t k = 0; k < s.size; ++k) s.points[k].w += shift;
    const SimplexPoint p = nearest_point(s);
    Vec3 mean = Vec3::Zero();
    Real sum = 0;
    for (std::size_t k = 0; k < p.size; ++k) {
      EXPECT_GT(p.weight[k], -1e-14);
      mean += p.weight[k] * s.points[p.corner[k]].w;
      sum += p.weight[k];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_LT((mean - p.v).norm(), 1e-10);
    EXPECT_NEAR(p.v.squaredNorm(), p.squared, 1e-14);
    for (std::size_t k = 0; k < s.size; ++k) EXPECT_GE(p.v.dot(s.points[k].w), p.squared - 1e-12);
  }
}

// The plane of the triangle is 1e-8 from the origin, nearly below the middle of an edge. The
// direction is accurate to 1e-8 if it is computed from the edge, and exact from the face.
TEST(NearestPoint, PrefersTheFaceToTheEdgeUnderTheOrigin) {
  Dice dice(2);
  for (int i = 0; i < 10'000; ++i) {
    const Mat3 R = dice.rotation().toRotationMatrix();
    const Real a = dice.uniform(0.5, 2), b = dice.uniform(0.5, 2);
    const Simplex s = simplex_of({R * Vec3(-a, 1e-8, 0), R * Vec3(b, 1e-8, 0), R * Vec3(0.2, 1e-8, 1)});
    const SimplexPoint p = nearest_point(s);
    EXPECT_EQ(p.size, 3u) << i;
    EXPECT_LT((p.v.normalized() - R.col(1)).norm(), 1e-14);
  }
}

// The vector to the nearest point is perpendicular to the edge. The error is a rounding error of the length
// of this vector, not of the length of the edge.
TEST(NearestPoint, OfAnEdgeIsPerpendicularToItAtAnyDistance) {
  Dice dice(3);
  for (int i = 0; i < 10'000; ++i) {
    const Mat3 R = dice.rotation().toRotationMatrix();
    const Vec3 p = R * Vec3(-dice.uniform(0.5, 2), 1e-9, 0), q = R * Vec3(dice.uniform(0.5, 2), 1e-9, 0);
    const SimplexPoint nearest = nearest_point(simplex_of({p, q}));
    EXPECT_EQ(nearest.size, 2u);
    EXPECT_LT(std::abs((q - p).normalized().dot(nearest.v)), 4e-16 * std::sqrt(nearest.squared));
  }
}

}  // namespace
}  // namespace offstage::sim
