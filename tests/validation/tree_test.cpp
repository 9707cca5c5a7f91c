/// Row of the validation table: tree queries compared with brute force, for 10^4 random poses of meshes and
/// all three tree kinds; the pairs must be the same.

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "tests/mesh_pair_oracle.h"

namespace offstage::sim {
namespace {

TEST(Trees, FindTheIntersectingPairsOfBruteForceInTenThousandPoses) {
  const TriangleMesh mesh_a = bumpy_sphere(12, 9, 1), mesh_b = torus_mesh(0.8, 0.3, 12, 8);
  const AllTrees trees_a(mesh_a), trees_b(mesh_b);
  std::size_t found = 0, poses_apart = 0;
  for (uint64_t i = 0; i < 10'000; ++i) {
    const Pose pose = random_pose(i, 2.5);
    const auto brute = brute_pairs(mesh_a, mesh_b, pose);
    found += brute.size();
    poses_apart += brute.empty();
    // Each pose uses three of the nine combinations in turn.
    uint64_t combination = 0;
    for_each_kind(trees_a, trees_b, [&](const auto& a, const auto& b) {
      if ((combination++ + i) % 3 != 0) return;
      std::vector<TrianglePair> pairs;
      intersecting_triangles(a, b, pose, pairs);
      std::sort(pairs.begin(), pairs.end());
      ASSERT_EQ(pairs, brute) << i;
      ASSERT_EQ(surfaces_intersect(a, b, pose), !brute.empty()) << i;
    });
  }
  EXPECT_GT(found, 100'000u);
  EXPECT_GT(poses_apart, 1000u);
  EXPECT_LT(poses_apart, 9000u);
}

}  // namespace
}  // namespace offstage::sim
