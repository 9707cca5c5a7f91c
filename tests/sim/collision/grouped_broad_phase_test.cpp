#include "sim/collision/grouped_broad_phase.h"

#include <gtest/gtest.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kObjects = 120;

/// Returns a box near the box of the previous object, as in a chain.
Aabb link_box(const Scatter& random, uint64_t event, uint32_t object) {
  const Vec3 centre(0.3 * (object % 40), object / 40, 0.3 * random.uniform(event, 0));
  const Vec3 half = Vec3::Constant(0.05 + 0.2 * random.uniform(event, 1));
  return {centre - half, centre + half};
}

// Groups of different sizes form, move, lose members and dissolve.
TEST(GroupedBroadPhase, FindsThePairsOfOneWithoutGroups) {
  const Scatter random{11};
  GroupedBroadPhase grouped;
  BroadPhase plain;
  std::size_t found = 0;
  for (uint64_t step = 0; step < 200; ++step) {
    for (uint32_t i = 0; i < kObjects; ++i) {
      const uint64_t event = 1000 * step + i;
      const Aabb box = link_box(random, event, i);
      if (!plain.contains(i)) {
        if (random.uniform(event, 2) > 0.5) continue;
        // Objects from 100 on are static.
        plain.insert(i, box, i >= 100);
        grouped.insert(i, box, i >= 100);
      } else if (random.uniform(event, 3) < 0.01) {
        plain.remove(i);
        grouped.remove(i);
      } else if (random.uniform(event, 4) < (step % 3 == 0 ? 0.0 : 0.3)) {
        plain.move(i, box);
        grouped.move(i, box);
      }
      ASSERT_EQ(plain.contains(i), grouped.contains(i));
    }
    if (step % 7 == 0) {
      std::vector<std::vector<uint32_t>> groups(static_cast<std::size_t>(1 + 20 * random.uniform(step, 5)));
      for (uint32_t i = 0; i < 100; ++i)
        if (const Real where = random.uniform(step, 6 + i); grouped.contains(i) && where < 0.8)
          groups[static_cast<std::size_t>(where / 0.8 * static_cast<Real>(groups.size()))].push_back(i);
      grouped.set_groups(groups);
    }
    const auto pairs = grouped.pairs(), expected = plain.pairs();
    ASSERT_EQ(std::vector(pairs.begin(), pairs.end()), std::vector(expected.begin(), expected.end())) << step;
    found += pairs.size();
  }
  EXPECT_GT(found, 5000u);
}

}  // namespace
}  // namespace offstage::sim
