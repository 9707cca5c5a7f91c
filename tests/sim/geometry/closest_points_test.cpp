#include "sim/geometry/closest_points.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

using Precise = long double;
using PreciseVec = Eigen::Matrix<Precise, 3, 1>;

PreciseVec precise(const Vec3& v) {
  return v.cast<Precise>();
}

/// Returns the minimum of a convex function on [0, 1] by golden section search, without any case
/// distinctions. Searches can be nested.
template <class F>
Precise minimum(int steps, F&& f) {
  constexpr Precise kRatio = 0.618033988749894848204586834L;
  Precise low = 0, high = 1;
  Precise x = high - kRatio * (high - low), y = low + kRatio * (high - low), fx = f(x), fy = f(y);
  for (int i = 0; i < steps; ++i) {
    if (fx < fy) {
      high = y, y = x, fy = fx;
      x = high - kRatio * (high - low), fx = f(x);
    } else {
      low = x, x = y, fx = fy;
      y = low + kRatio * (high - low), fy = f(y);
    }
  }
  return std::min({fx, fy, f(0), f(1)});
}

Precise point_segment(const PreciseVec& p, const PreciseVec& a, const PreciseVec& b) {
  const PreciseVec ab = b - a;
  const Precise length2 = ab.squaredNorm();
  const Precise t = length2 > 0 ? std::clamp(ab.dot(p - a) / length2, Precise{0}, Precise{1}) : Precise{0};
  return (p - a - t * ab).norm();
}

Precise segments(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1) {
  const PreciseVec p = precise(p0), d = precise(p1) - p;
  return minimum(80, [&](Precise s) { return point_segment(p + s * d, precise(q0), precise(q1)); });
}

/// Treats the triangle as the union of its segments parallel to one side. Along these, unlike along a fan,
/// the distance is convex.
Precise point_triangle(const PreciseVec& p, const TriangleVertices& t, int steps = 80) {
  const PreciseVec a = precise(t[0]), b = precise(t[1]), c = precise(t[2]);
  return minimum(steps, [&](Precise s) { return point_segment(p, a + s * (b - a), c + s * (b - c)); });
}

struct Sample {
  Scatter random;
  uint64_t i;
  uint32_t used = 0;

  Real next() { return random.uniform(i, used++); }
  /// Returns a point on a coarse grid, a random point, or one near the previous point, so that degenerate and
  /// nearly degenerate figures are frequent.
  Vec3 point(const Vec3& last) {
    const Real kind = next();
    const Vec3 p(next() - 0.5, next() - 0.5, next() - 0.5);
    if (kind < 0.4) return (p * 4).array().round() / 4;
    if (kind < 0.5) return last;
    if (kind < 0.7) return last + p * std::pow(10.0, -9 * next());
    return p;
  }
};

TEST(ClosestPoints, OfSegmentsMatchTheMinimumBySearch) {
  for (uint64_t i = 0; i < 20000; ++i) {
    Sample sample{{3}, i};
    const Vec3 p0 = sample.point(Vec3::Zero()), p1 = sample.point(p0), q0 = sample.point(p1);
    Vec3 q1 = sample.point(q0);
    if (i % 3 == 0)
      q1 = q0 + (p1 - p0) * (1 + sample.next()) + (q1 - q0) * std::pow(10.0, -16 * sample.next());
    const ClosestPoints c = closest_on_segments(p0, p1, q0, q1);
    ASSERT_NEAR(static_cast<double>(segments(p0, p1, q0, q1)), std::sqrt(c.squared_distance), 1e-12) << i;
    ASSERT_NEAR((c.on_a - c.on_b).norm(), std::sqrt(c.squared_distance), 1e-15);
    ASSERT_LT(point_segment(precise(c.on_a), precise(p0), precise(p1)), 1e-15L);
    ASSERT_LT(point_segment(precise(c.on_b), precise(q0), precise(q1)), 1e-15L);
  }
}

TEST(ClosestPoints, OnATriangleMatchTheMinimumBySearch) {
  for (uint64_t i = 0; i < 20000; ++i) {
    Sample sample{{4}, i};
    const Vec3 a = sample.point(Vec3::Zero()), b = sample.point(a), c = sample.point(b);
    const Vec3 p = sample.point((a + b + c) / 3);
    const TrianglePoint q = closest_on_triangle(p, a, b, c);
    // The effect of a rounding error of one unit in the last place along a sliver.
    const Real area = (b - a).cross(c - a).norm();
    const Real along = area > 0 ? 1e-15 * (b - a).norm() * (c - a).norm() / area : 0;
    ASSERT_NEAR(static_cast<double>(point_triangle(precise(p), {a, b, c})), (p - q.point).norm(),
                1e-14 + along)
        << i;
    ASSERT_LT((q.weights[0] * a + q.weights[1] * b + q.weights[2] * c - q.point).norm(), 1e-14) << i;
    for (Real w : q.weights) ASSERT_GE(w, -1e-15);
    ASSERT_NEAR(q.weights[0] + q.weights[1] + q.weights[2], 1, 1e-15);
  }
}

TEST(ClosestPoints, WeightsOnATriangleNameTheFeature) {
  const Vec3 a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  const auto weights = [&](const Vec3& p) { return closest_on_triangle(p, a, b, c).weights; };
  EXPECT_EQ(weights({-1, -1, 3}), (std::array<Real, 3>{1, 0, 0}));
  EXPECT_EQ(weights({5, -1, 3}), (std::array<Real, 3>{0, 1, 0}));
  EXPECT_EQ(weights({1, -1, 3}), (std::array<Real, 3>{0.5, 0.5, 0}));
  EXPECT_EQ(weights({3, 3, -1}), (std::array<Real, 3>{0, 0.5, 0.5}));
  EXPECT_EQ(weights({0.5, 0.5, 1}), (std::array<Real, 3>{0.5, 0.25, 0.25}));
}

/// Compares random triangles, some of which touch, intersect or are degenerate, with a search in four
/// dimensions.
void compare_triangles(uint64_t from, uint64_t to) {
  constexpr int kSteps = 40;  // to a width of 5e-9, within which a minimum at a kink may lie anywhere
  for (uint64_t i = from; i < to; ++i) {
    Sample sample{{5}, i};
    TriangleVertices a, b;
    Vec3 last = Vec3::Zero();
    for (Vec3& v : a) v = last = sample.point(last);
    last = sample.point(last);
    for (Vec3& v : b) v = last = sample.point(last);
    const PreciseVec a0 = precise(a[0]), a1 = precise(a[1]), a2 = precise(a[2]);
    const Precise truth = minimum(kSteps, [&](Precise s) {
      const PreciseVec start = a0 + s * (a1 - a0), end = a2 + s * (a1 - a2);
      return minimum(kSteps, [&](Precise t) { return point_triangle(start + t * (end - start), b, kSteps); });
    });
    const ClosestPoints c = closest_on_triangles(a, b);
    ASSERT_NEAR(static_cast<double>(truth), std::sqrt(c.squared_distance), 2e-8) << i;
    ASSERT_NEAR((c.on_a - c.on_b).norm(), std::sqrt(c.squared_distance), 1e-15) << i;
    // A common point of slivers that cross at a small angle is only as accurate as the angle.
    const Precise tolerance = c.squared_distance > 0 ? 1e-14L : 1e-10L;
    ASSERT_LT(point_triangle(precise(c.on_a), a), tolerance) << i;
    ASSERT_LT(point_triangle(precise(c.on_b), b), tolerance) << i;
    ASSERT_TRUE(c.squared_distance == 0 || !triangles_intersect(a, b)) << i;
  }
}

TEST(ClosestPoints, OfTrianglesMatchTheMinimumBySearch) {
  compare_triangles(0, 60);
}

TEST(LongClosestPoints, OfTrianglesMatchTheMinimumBySearch) {
  compare_triangles(60, 5000);
}

TEST(ClosestPoints, ScaleWithTheFigure) {
  const Vec3 p0(0.3, 0.1, -0.2), p1(-0.4, 0.7, 0.1), q0(0.9, -0.3, 0.5), q1(1.1, 0.8, -0.6);
  const ClosestPoints one = closest_on_segments(p0, p1, q0, q1);
  for (Real scale : {0x1p-30, 0x1p30}) {
    const ClosestPoints c = closest_on_segments(scale * p0, scale * p1, scale * q0, scale * q1);
    EXPECT_EQ(c.on_a, scale * one.on_a);
    EXPECT_EQ(c.on_b, scale * one.on_b);
  }
}

TEST(ClosestPoints, OfSegmentAndPlane) {
  const Vec3 n(0, 1, 0);
  const ClosestPoints crossing = closest_segment_plane({0, 3, 0}, {4, -1, 0}, n, 2);
  EXPECT_EQ(crossing.on_a, Vec3(1, 2, 0));
  EXPECT_EQ(crossing.squared_distance, 0);
  const ClosestPoints above = closest_segment_plane({0, 7, 5}, {4, 3, 1}, n, 2);
  EXPECT_EQ(above.on_a, Vec3(4, 3, 1));
  EXPECT_EQ(above.on_b, Vec3(4, 2, 1));
  EXPECT_EQ(above.squared_distance, 1);
  EXPECT_EQ(closest_segment_plane({0, 1, 5}, {4, -3, 1}, n, 2).on_b, Vec3(0, 2, 5)) << "below";
  EXPECT_EQ(closest_segment_plane({0, 2, 5}, {4, 2, 1}, n, 2).squared_distance, 0) << "within";
}

}  // namespace
}  // namespace offstage::sim
