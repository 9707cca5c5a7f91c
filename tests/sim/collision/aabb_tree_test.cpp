#include "sim/collision/aabb_tree.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

std::vector<Aabb> random_boxes(std::size_t n, bool clustered) {
  const Scatter random{3};
  std::vector<Aabb> boxes;
  for (uint64_t i = 0; i < n; ++i) {
    Vec3 p, s;
    for (uint32_t k = 0; k < 3; ++k) {
      p[k] = random.uniform(i, k);
      if (clustered) p[k] = std::pow(p[k], 20);  // nearly all at one corner: the mean is useless
      s[k] = 0.05 * random.uniform(i, 3 + k);
    }
    boxes.emplace_back(p, p + s);
  }
  return boxes;
}

TEST(AabbTree, FindsExactlyWhatBruteForceFinds) {
  for (bool clustered : {false, true}) {
    const auto boxes = random_boxes(1000, clustered);
    const AabbTree tree(boxes);
    for (const Aabb& query : random_boxes(200, clustered)) {
      std::set<uint32_t> brute, found;
      for (uint32_t i = 0; i < boxes.size(); ++i)
        if (boxes[i].intersects(query)) brute.insert(i);
      tree.overlapping(query, [&](uint32_t i) {
        if (!boxes[i].intersects(query)) return;
        EXPECT_TRUE(found.insert(i).second) << "twice";
      });
      ASSERT_EQ(found, brute);
    }
  }
}

TEST(AabbTree, NearestIsTheNearestAndFewAreVisited) {
  const auto boxes = random_boxes(4000, false);
  const AabbTree tree(boxes);
  for (const Aabb& query : random_boxes(100, false)) {
    const Vec3 p = query.center() * 1.2;
    Real brute = 1e30, best = 1e30;
    for (const Aabb& b : boxes) brute = std::min(brute, b.squaredExteriorDistance(p));
    int visits = 0;
    tree.nearest(p, [&](uint32_t i) {
      ++visits;
      best = std::min(best, boxes[i].squaredExteriorDistance(p));
      return boxes[i].squaredExteriorDistance(p);
    });
    ASSERT_EQ(best, brute);
    ASSERT_LT(visits, 400);
  }
}

TEST(AabbTree, CoincidentItemsShareALeafAndEmptyTreesHaveNothing) {
  const std::vector<Aabb> same(100, Aabb(Vec3::Zero(), Vec3::Ones()));
  int count = 0;
  AabbTree(same).overlapping(Aabb(Vec3::Zero(), Vec3::Zero()), [&](uint32_t) { ++count; });
  EXPECT_EQ(count, 100);
  const AabbTree empty;
  empty.overlapping(same[0], [](uint32_t) { FAIL(); });
  EXPECT_TRUE(empty.bounds().isEmpty());
}

}  // namespace
}  // namespace offstage::sim
