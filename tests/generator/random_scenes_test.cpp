/// In random scenes, no object explodes, leaves the room or sinks into another one, and the work of each step
/// is bounded. To run one scene again: OFFSTAGE_SEED=1234 build/test_generator --gtest_filter='*Replays*' For
/// a scene of bodies only, set OFFSTAGE_BODIES=1, too.

#include <cstdlib>
#include <iostream>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "tests/generator/random_scene.h"

namespace offstage::sim {
namespace {

/// One scene out of this many is run again with other numbers of threads.
constexpr uint64_t kThreadsEvery = 10;

Findings with_threads(const RandomScene& scene, std::size_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  return simulate(scene);
}

void check(uint64_t seed, Parts parts) {
  const RandomScene scene = random_scene(seed, parts);
  const Findings found = simulate(scene);
  EXPECT_EQ(faults(scene, found), "")
      << "seed " << seed << "; see it with " << (parts == Parts::bodies ? "OFFSTAGE_BODIES=1 " : "")
      << "OFFSTAGE_SEED=" << seed << " test_generator --gtest_filter='*Replays*'";
  if (seed % kThreadsEvery != 0) return;
  for (const std::size_t threads : {1, 3})
    EXPECT_EQ(with_threads(scene, threads).hash, found.hash)
        << "seed " << seed << ", " << threads << " threads";
}

/// Parameter: number of a block of a hundred scenes.
class RandomScenes : public testing::TestWithParam<uint64_t> {
 protected:
  static void check_block(Parts parts) {
    constexpr uint64_t kBlock = 100;
    for (uint64_t seed = GetParam() * kBlock; seed < (GetParam() + 1) * kBlock; ++seed) check(seed, parts);
  }
};
class RandomBodies : public RandomScenes {};

TEST_P(RandomBodies, KeepEnergyMomentumBoundsAndTime) {
  check_block(Parts::bodies);
}
// Known failures of the long tests: overlaps of 1.03 to 1.7 times the allowed depth (4759, 2228, 3730),
// angular momentum off by 1.4e-3 and 1.8e-3 with joints (522, 1191), a gain of 2.6 % of the energy (3456),
// and 1.24 times the allowed work (4734).
INSTANTIATE_TEST_SUITE_P(Some, RandomBodies, testing::Values<uint64_t>(2, 3, 4, 6));
INSTANTIATE_TEST_SUITE_P(LongFirst, RandomBodies, testing::Values<uint64_t>(0, 1, 5));
INSTANTIATE_TEST_SUITE_P(Long, RandomBodies, testing::Range<uint64_t>(7, 50));

TEST_P(RandomScenes, KeepEnergyMomentumBoundsAndTime) {
  check_block(Parts::all);
}
INSTANTIATE_TEST_SUITE_P(Long, RandomScenes, testing::Range<uint64_t>(0, 50));

/// A tool rather than a test: it exists only if OFFSTAGE_SEED names the seed of a scene to run again.
class ReplayedScene : public testing::TestWithParam<uint64_t> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ReplayedScene);

std::vector<uint64_t> seeds_to_replay() {
  const char* seed = std::getenv("OFFSTAGE_SEED");
  return seed ? std::vector<uint64_t>{std::strtoull(seed, nullptr, 10)} : std::vector<uint64_t>();
}

TEST_P(ReplayedScene, Replays) {
  const Parts parts = std::getenv("OFFSTAGE_BODIES") ? Parts::bodies : Parts::all;
  const RandomScene scene = random_scene(GetParam(), parts);
  const Findings f = simulate(scene);
  std::cout << text(scene) << "energy gain " << f.energy_gain << " J of " << f.energy_scale << " J before "
            << f.gained_at << " s; overlap " << f.penetration << " m; momentum off by " << f.momentum_error
            << ", " << f.angular_momentum_error << "; work " << f.work << "; " << f.rough << " fall-backs\n";
  EXPECT_EQ(faults(scene, f), "");
}
INSTANTIATE_TEST_SUITE_P(Seed, ReplayedScene, testing::ValuesIn(seeds_to_replay()));

// These seeds have universal joints near their singular pose (204, 256, 454), and particles between a body
// and a wall (357, 419, 454, 907).
TEST(RandomScene, SeedsThatGainedEnergyKeepIt) {
  for (const uint64_t seed : {204, 256, 357, 419, 454, 907}) check(seed, Parts::all);
}

// These seeds have joints at their limits (64, 261, 346, 428), and light links with heavy bodies behind them
// at a wall (8, 73, 699).
TEST(RandomScene, SeedsWithJointsKeepMomentumAndDoNotOverlap) {
  for (const uint64_t seed : {8, 64, 73, 261, 346, 428, 699}) check(seed, Parts::all);
}

// Bodies overlapped with these seeds: contacts near a second piece of a body (87, 2004, 3392) or with the
// side of a cone (1189) were taken for seams; other points of a rim hit after the first one (1133, 2281); and
// a thin rod spun up (3876).
TEST(RandomScene, SeedsOfBodiesThatOverlappedDoNot) {
  for (const uint64_t seed : {87, 1133, 1189, 2004, 2281, 3392, 3876}) check(seed, Parts::bodies);
}

// A contact that rebounded pushed again at the end of the step, because the bodies turned, although it had a
// gap by then. The bodies gained 0.7 % of their energy.
TEST(RandomScene, SeedOfTurningBodiesThatReboundKeepsItsEnergy) {
  check(2521, Parts::bodies);
}

// A rod that rebounded at one corner was pushed at another one, at the place where that corner had been
// before it turned by almost a radian. It gained 27 J.
TEST(RandomScene, SeedOfARodThatTumblesAwayKeepsItsEnergy) {
  check(4975, Parts::bodies);
}

// An articulation, whose links have less than 100 times the mass of a plate, pressed the plate into the
// floor.
TEST(RandomScene, SeedWithALightBodyUnderAnArticulationKeepsBounds) {
  check(4670, Parts::all);
}

// A contact that is expected at the end of the sub-step, moved back to its start, seemed to touch there. It
// pushed before the impact for which the pair waits, and the impact was searched on the changed paths.
TEST(RandomScene, SeedWithAnExpectedContactWaitsForItsImpact) {
  check(4783, Parts::all);
}

// With these seeds, a step stopped only some of the links of an articulation (197, 894, 2457, 2865, 3239,
// 3810, 3893, 3932, 3974, 4062), or light links turned far in a step (256, 1569, 4400).
TEST(RandomScene, SeedsWithJointsStopAllLinks) {
  for (const uint64_t seed : {197, 256, 894, 1569, 2457, 2865, 3239, 3810, 3893, 3932, 3974, 4062, 4400})
    check(seed, Parts::all);
}

// The same seed gives the same scene, so that failures can be reproduced.
TEST(RandomScene, DependsOnlyOnItsSeed) {
  EXPECT_EQ(text(random_scene(42, Parts::all)), text(random_scene(42, Parts::all)));
  EXPECT_NE(text(random_scene(42, Parts::all)), text(random_scene(43, Parts::all)));
}

}  // namespace
}  // namespace offstage::sim
