#include "sim/dynamics/neighbor_grid.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

std::vector<Vec3> scattered(std::size_t count, const Vec3& size, uint64_t seed) {
  const Scatter random{seed};
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(Vec3(random.uniform(i, 0) - 0.5, random.uniform(i, 1) - 0.5, random.uniform(i, 2) - 0.5)
                         .cwiseProduct(size));
  return points;
}

std::vector<uint32_t> near(const NeighborGrid& grid, const Vec3& p, Real radius) {
  std::vector<uint32_t> found;
  grid.for_each_near(p, radius, [&](uint32_t i) { found.push_back(i); });
  std::sort(found.begin(), found.end());
  return found;
}

TEST(NeighborGrid, FindsEachPointWithinTheRadiusOnceLikeAllPairs) {
  for (const Vec3& size : {Vec3(1, 1, 1), Vec3(0.01, 20, 1), Vec3(3, 0, 3), Vec3(0, 0, 0)}) {
    std::vector<Vec3> points = scattered(700, size, 1);
    points.emplace_back(1e4, -1e5, 1e300);  // one point extremely far away
    NeighborGrid grid;
    grid.build(points, 0.1);
    for (Real radius : {0.02, 0.1, 0.35, 5.0})
      for (std::size_t i = 0; i < points.size(); i += 7) {
        std::vector<uint32_t> expected;
        for (uint32_t j = 0; j < points.size(); ++j)
          if ((points[i] - points[j]).squaredNorm() <= radius * radius) expected.push_back(j);
        ASSERT_EQ(near(grid, points[i], radius), expected);
      }
  }
}

TEST(NeighborGrid, OrderIsTheSameForAnyNumberOfThreadsAndLayersHoldNeighbours) {
  const std::vector<Vec3> points = scattered(50'000, {3, 1, 2}, 2);
  std::vector<uint32_t> first;
  for (std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    NeighborGrid grid;
    grid.build(points, 0.05);
    std::vector<uint32_t> order, layer(points.size());
    for (uint32_t k = 0; k < grid.layers(); ++k)
      for (std::size_t e = grid.layer_begin(k); e < grid.layer_begin(k + 1); ++e) {
        order.push_back(grid.at(e));
        layer[grid.at(e)] = k;
      }
    ASSERT_EQ(order.size(), points.size());
    if (first.empty()) first = order;
    ASSERT_EQ(order, first);
    for (uint32_t i = 0; i < 2000; ++i)
      grid.for_each_near(points[i], 0.05, [&](uint32_t j) {
        const uint32_t apart = (layer[i] - layer[j]) & (grid.layers() - 1);
        ASSERT_TRUE(apart <= 1 || apart == grid.layers() - 1);
      });
  }
}

TEST(NeighborGrid, OfNoPointsIsEmpty) {
  NeighborGrid grid;
  EXPECT_TRUE(near(grid, Vec3::Zero(), 1).empty());
  grid.build(std::vector<Vec3>{Vec3::Zero()}, 1);
  grid.build({}, 1);
  EXPECT_TRUE(near(grid, Vec3::Zero(), 1).empty());
}

}  // namespace
}  // namespace offstage::sim
