#include "sim/geometry/intersection.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "sim/geometry/closest_points.h"
#include "sim/geometry/predicates.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

/// Vectors of whole numbers, and an exact reference for the intersection of the convex hulls of a few points.
__extension__ typedef __int128 Whole;

struct WholeVec {
  Whole x, y, z;
  friend WholeVec operator-(const WholeVec& a, const WholeVec& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
};

Whole dot(const WholeVec& a, const WholeVec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
WholeVec cross(const WholeVec& a, const WholeVec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

WholeVec whole(const Vec3& v) {
  return {static_cast<Whole>(v.x()), static_cast<Whole>(v.y()), static_cast<Whole>(v.z())};
}

bool separated(const WholeVec& axis, const std::vector<WholeVec>& a, const std::vector<WholeVec>& b) {
  const auto before = [&](const WholeVec& p, const WholeVec& q) { return dot(axis, p) < dot(axis, q); };
  const auto [a_low, a_high] = std::minmax_element(a.begin(), a.end(), before);
  const auto [b_low, b_high] = std::minmax_element(b.begin(), b.end(), before);
  return before(*a_high, *b_low) || before(*b_high, *a_low);
}

/// Returns whether the convex hulls of two sets of points intersect, exactly. They are disjoint if and only
/// if some plane strictly separates them. A separating plane can be turned until its normal is a difference
/// of two points, is perpendicular to two such differences, or is perpendicular to one within the plane of
/// two.
bool exactly_intersect(const std::vector<WholeVec>& a, const std::vector<WholeVec>& b) {
  std::vector<WholeVec> differences, normals;
  for (const auto* own : {&a, &b})
    for (std::size_t i = 0; i < own->size(); ++i)
      for (std::size_t j = 0; j < i; ++j) differences.push_back((*own)[i] - (*own)[j]);
  for (const WholeVec& p : a)
    for (const WholeVec& q : b) differences.push_back(p - q);
  for (std::size_t i = 0; i < differences.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) normals.push_back(cross(differences[i], differences[j]));
  const auto separates = [&](const WholeVec& axis) { return separated(axis, a, b); };
  return std::none_of(differences.begin(), differences.end(), separates) &&
         std::none_of(normals.begin(), normals.end(), separates) &&
         std::none_of(normals.begin(), normals.end(), [&](const WholeVec& n) {
           return std::any_of(differences.begin(), differences.end(),
                              [&](const WholeVec& d) { return separates(cross(n, d)); });
         });
}

template <class... P>
std::vector<WholeVec> hull(const P&... points) {
  return {whole(points)...};
}

/// Returns a point of a grid so small that most triangles are degenerate, touch, or are coplanar.
Vec3 grid_point(int side, int stretch) {
  const auto coordinate = rc::gen::map(rc::gen::inRange(0, side), [=](int i) { return Real(i * stretch); });
  return {*coordinate, *coordinate, *coordinate};
}

TEST(Intersection, OfGridTrianglesIsExact) {
  EXPECT_TRUE(rc::check([] {
    const int side = *rc::gen::inRange(2, 6), stretch = *rc::gen::element(1, 12345);
    const auto point = [=] { return grid_point(side, stretch); };
    for (int i = 0; i < 30; ++i) {
      const TriangleVertices a = {point(), point(), point()}, b = {point(), point(), point()};
      const bool truth = exactly_intersect(hull(a[0], a[1], a[2]), hull(b[0], b[1], b[2]));
      RC_ASSERT(triangles_intersect(a, b) == truth);
      RC_ASSERT(triangles_intersect(b, a) == truth);
      RC_ASSERT(triangles_intersect({a[2], a[1], a[0]}, {b[1], b[2], b[0]}) == truth);
    }
  }));
}

TEST(Intersection, OfGridSegmentsAndPointsIsExact) {
  EXPECT_TRUE(rc::check([] {
    const int side = *rc::gen::inRange(2, 5), stretch = *rc::gen::element(1, 12345);
    const auto point = [=] { return grid_point(side, stretch); };
    for (int i = 0; i < 30; ++i) {
      const Vec3 p = point(), q = point(), r = point(), s = point();
      const TriangleVertices t = {point(), point(), point()};
      const auto triangle = hull(t[0], t[1], t[2]);
      RC_ASSERT(segment_intersects_triangle(p, q, t) == exactly_intersect(hull(p, q), triangle));
      RC_ASSERT(segments_intersect(p, q, r, s) == exactly_intersect(hull(p, q), hull(r, s)));
      RC_ASSERT(point_in_triangle(p, t) == exactly_intersect(hull(p), triangle));
    }
  }));
}

// Points a few units away from a line: the exact determinants are far below the rounding error of naive ones.
TEST(Predicates, AreExactWhereRoundingIsNot) {
  constexpr Real kUnit = 0x1p-38;  // all coordinates are whole multiples of it, so the reference is exact
  const Scatter random{1};
  int naive_wrong = 0;
  for (uint64_t i = 0; i < 5000; ++i) {
    const auto whole_number = [&](uint64_t k, Real range) {
      return std::floor(random.uniform(i, k) * range);
    };
    std::array<Vec3, 4> v;
    std::array<WholeVec, 4> scaled;
    for (uint32_t k = 0; k < 4; ++k) {
      const Real along = whole_number(k, 8);
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const Real units = along * whole_number(4 + axis, 0x1p30) + whole_number(8 + 3 * k + axis, 3);
        v[k][axis] = 100 + units * kUnit;
        (&scaled[k].x)[axis] = static_cast<Whole>(units);
      }
    }
    const auto [a, b, c, d] = scaled;
    const Whole volume = dot(cross(b - a, c - a), d - a);
    const Real value = orient3d(v[0], v[1], v[2], v[3]);
    ASSERT_EQ(value > 0, volume > 0) << i;
    ASSERT_EQ(value < 0, volume < 0) << i;
    const Real naive = (v[1] - v[0]).cross(v[2] - v[0]).dot(v[3] - v[0]);
    naive_wrong += (naive > 0) != (volume > 0);
  }
  EXPECT_GT(naive_wrong, 500) << "the inputs are not hard enough to show anything";
}

// The example of Kettner, Mehlhorn, Pion, Schirra and Yap (2008): near 1/2, the differences to 12 and 24 are
// rounded.
TEST(Predicates, InThePlaneAreExactWhereRoundingIsNot) {
  int naive_wrong = 0;
  for (int i = 0; i < 128; ++i)
    for (int j = 0; j < 128; ++j) {
      const Eigen::Vector2d a(0.5 + i * 0x1p-53, 0.5 + j * 0x1p-53), b(12, 12), c(24, 24);
      // The line is x = y.
      ASSERT_EQ(orient2d(a, b, c) > 0, i < j);
      ASSERT_EQ(orient2d(a, b, c) < 0, i > j);
      const Real naive = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
      naive_wrong += (naive > 0) != (i < j);
    }
  EXPECT_GT(naive_wrong, 500);
}

// A segment through the shared edge of two triangles, or within rounding of it, hits at least one of them.
TEST(Intersection, NothingSlipsThroughASharedEdge) {
  const Scatter random{2};
  for (uint64_t i = 0; i < 5000; ++i) {
    const auto vec = [&](uint32_t k) {
      return Vec3(random.uniform(i, k) - 0.5, random.uniform(i, k + 1) - 0.5, random.uniform(i, k + 2) - 0.5);
    };
    const Vec3 a(0.1, -3, 0.2), b(-0.2, 3, 0.1), left(-3, 0, vec(0).x()), right(3, 0, vec(0).y());
    const Vec3 on_edge = a + random.uniform(i, 20) * (b - a), p = vec(4) + Vec3(0, 0, 2);
    const Vec3 q = on_edge + (on_edge - p);
    ASSERT_TRUE(segment_intersects_triangle(p, q, {a, b, left}) ||
                segment_intersects_triangle(p, q, {b, a, right}))
        << i;
  }
}

TEST(Intersection, OfGridTrianglesAndBoxesIsExact) {
  EXPECT_TRUE(rc::check([] {
    for (int i = 0; i < 2; ++i) {
      const auto point = [] { return grid_point(6, 2); };
      const TriangleVertices t = {point(), point(), point()};
      const Vec3 p = point(), q = point();
      const Aabb box(p.cwiseMin(q), p.cwiseMax(q));
      std::vector<WholeVec> corners;
      for (int k = 0; k < 8; ++k) corners.push_back(whole(box.corner(static_cast<Aabb::CornerType>(k))));
      RC_ASSERT(triangle_intersects_box(t, box) == exactly_intersect(hull(t[0], t[1], t[2]), corners));
    }
  }));
}

TEST(Intersection, OfTriangleAndSphereIsByTheNearestPoint) {
  const TriangleVertices t = {Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(0, 3, 0)};
  EXPECT_TRUE(triangle_intersects_sphere(t, Vec3(1, 1, 2), 2)) << "touches the face";
  EXPECT_FALSE(triangle_intersects_sphere(t, Vec3(1, 1, 2), 1.999999));
  EXPECT_TRUE(triangle_intersects_sphere(t, Vec3(2, -1, 0), 1)) << "touches an edge";
  EXPECT_FALSE(triangle_intersects_sphere(t, Vec3(2, -1, 0), 0.999999));
  EXPECT_TRUE(triangle_intersects_sphere(t, Vec3(7, 4, 0), 5)) << "touches a vertex";
  EXPECT_FALSE(triangle_intersects_sphere(t, Vec3(7, 4, 0), 4.999999));
  EXPECT_TRUE(triangle_intersects_sphere({t[1], t[1], t[1]}, Vec3(7, 4, 0), 5)) << "a point";
}

}  // namespace
}  // namespace offstage::sim
