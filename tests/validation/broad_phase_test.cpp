/// Row "grid, uniform and multi-level, against all-pairs" of the validation table.

#include "sim/collision/broad_phase.h"

#include <cmath>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

// A crowd of spheres from 1 cm to 1 m moves about; a fifth of them rests at times, and some ground is static.
TEST(BroadPhase, GridsGiveTheSameCandidatesAsAllPairsAndNoneTwice) {
  constexpr uint32_t kSpheres = 1500;
  const Scatter random{11};
  BroadPhase uniform(GridKind::uniform), multilevel(GridKind::multilevel);
  std::vector<Aabb> boxes;
  for (uint32_t i = 0; i < kSpheres; ++i) {
    const Vec3 centre = 4 * Vec3(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2));
    const Vec3 radius = Vec3::Constant(0.005 * std::pow(100, random.uniform(i, 3)));
    boxes.emplace_back(centre - radius, centre + radius);
  }
  boxes.emplace_back(Vec3(-50, -1, -50), Vec3(50, 0, 50));
  for (uint32_t i = 0; i < boxes.size(); ++i)
    for (BroadPhase* grid : {&uniform, &multilevel}) grid->insert(i, boxes[i], i == kSpheres);

  for (uint64_t step = 0; step < 30; ++step) {
    std::set<std::pair<uint32_t, uint32_t>> all;
    for (uint32_t i = 0; i < boxes.size(); ++i)
      for (uint32_t k = i + 1; k < boxes.size(); ++k)
        if (boxes[i].intersects(boxes[k])) all.emplace(i, k);
    ASSERT_GT(all.size(), kSpheres);
    for (BroadPhase* grid : {&uniform, &multilevel}) {
      std::set<std::pair<uint32_t, uint32_t>> candidates;
      for (const auto& [a, b] : grid->pairs()) ASSERT_TRUE(candidates.emplace(a, b).second) << "twice";
      ASSERT_EQ(candidates, all) << "step " << step;
    }
    for (uint32_t i = 0; i < kSpheres; ++i) {
      if ((step / 8 + i) % 5 == 0) continue;
      const Vec3 way(random.uniform(i, 4) - 0.5, random.uniform(i, 5) - 0.5, random.uniform(i, 6) - 0.5);
      boxes[i].translate(0.1 * std::sin(0.3 * static_cast<Real>(step)) * way);
      for (BroadPhase* grid : {&uniform, &multilevel}) grid->move(i, boxes[i]);
    }
  }
}

}  // namespace
}  // namespace offstage::sim
