#include "sim/geometry/polygon.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

Real turn(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b - a).x() * (c - b).y() - (b - a).y() * (c - b).x();
}

Real area(const std::vector<Vec2>& polygon) {
  Real sum = 0;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    sum += turn(polygon[0], polygon[k], polygon[k + 1]) / 2;
  return sum;
}

/// Checks that the pieces are convex, use every vertex and fill the polygon.
void expect_convex_pieces(const std::vector<Vec2>& polygon) {
  const auto pieces = convex_pieces(polygon, 1e-9);
  ASSERT_FALSE(pieces.empty());
  Real sum = 0;
  std::vector<bool> used(polygon.size(), false);
  for (const auto& piece : pieces) {
    std::vector<Vec2> corners;
    for (uint32_t v : piece) {
      corners.push_back(polygon[v]);
      used[v] = true;
    }
    const std::size_t n = corners.size();
    for (std::size_t k = 0; k < n; ++k)
      EXPECT_GE(turn(corners[k], corners[(k + 1) % n], corners[(k + 2) % n]), -1e-6);
    EXPECT_GT(area(corners), 0);
    sum += area(corners);
  }
  EXPECT_NEAR(sum, area(polygon), 1e-12);
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
}

TEST(Polygon, ConvexPiecesFillIt) {
  expect_convex_pieces({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});
  // A comb-shaped polygon with vertices in the middle of straight sides.
  expect_convex_pieces({{0, 0},
                        {1, 0},
                        {2, 0},
                        {3, 0},
                        {5, 0},
                        {5, 2},
                        {4, 2},
                        {4, 1},
                        {3, 1},
                        {3, 2},
                        {2, 2},
                        {2, 1},
                        {1, 1},
                        {1, 2},
                        {0.5, 2},
                        {0, 2},
                        {0, 1}});
  for (uint64_t seed = 0; seed < 100; ++seed) {
    const Scatter random{seed};
    std::vector<Vec2> star;
    for (uint64_t k = 0; k < 5 + seed % 20; ++k) {
      const Real phi = 2 * std::numbers::pi * static_cast<Real>(k) / static_cast<Real>(5 + seed % 20);
      star.push_back((0.2 + random.uniform(k, 0)) * Vec2(std::cos(phi), std::sin(phi)));
    }
    SCOPED_TRACE(seed);
    expect_convex_pieces(star);
  }
}

TEST(Polygon, MayTouchItselfAtAVertex) {
  // A ring of squares around a hole, closed at two corners that coincide.
  expect_convex_pieces({{0, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 1}, {1, 1}, {1, 2}, {2, 2}, {2, 3}, {0, 3}});
}

TEST(Polygon, WellInsideKeepsItsMargin) {
  const std::vector<Vec2> l = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  EXPECT_TRUE(well_inside(l, {0.5, 0.5}, 0.4));
  EXPECT_FALSE(well_inside(l, {0.5, 0.5}, 0.6));
  EXPECT_TRUE(well_inside(l, {0.5, 1.5}, 0.1));
  EXPECT_FALSE(well_inside(l, {1.5, 1.5}, 0.1));
  EXPECT_FALSE(well_inside(l, {3, 1}, 0.1));
}

}  // namespace
}  // namespace offstage::sim
