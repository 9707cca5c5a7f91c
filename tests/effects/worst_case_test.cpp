#include "effects/worst_case.h"

#include <limits>

#include <gtest/gtest.h>

#include "births.h"

namespace offstage::effects {
namespace {

using namespace sim;

struct Count {
  uint64_t born, alive;
};

/// Returns the number of particles that an emitter creates in a simulation.
Count count(const EmitterDef& def, Real duration) {
  World world = empty_world();
  const auto system = world.add_particle_system({});
  Emitter emitter(def, system);
  uint64_t alive = 0;
  for (int i = 0; i < static_cast<int>(duration * 240); ++i) {
    run(world, 1.0 / 240, 240, emitter);
    alive = std::max<uint64_t>(alive, world.particle_count());
  }
  return {emitter.report().released, alive};
}

TEST(WorstCase, OfConstantParametersIsReached) {
  const std::vector<EmitterDef> defs = {
      {.release = {.rate = 120.0}, .particles = {.lifespan = 0.5}},
      {.surface = {.size = {1, 1}},
       .release = {.rate = 0.0, .count = 30.0, .interval = 0.25},
       .particles = {.lifespan = 0.6}},
      {.surface = {.size = {1, 1}},
       .release = {.rate = 0.0, .bursts = {{.time = 0.1, .count = 50.0, .cycles = 4, .interval = 0.2}}},
       .particles = {.lifespan = 0.5}},
      {.release = {.rate = 100.0, .start = 0.5, .end = 1.5}, .particles = {.lifespan = 30.0}}};
  for (const EmitterDef& def : defs) {
    const Count real = count(def, 2);
    const WorstCase bound = worst_case(def, 2);
    EXPECT_EQ(bound.alive, real.alive);
    EXPECT_EQ(bound.born, real.born);
  }
}

TEST(WorstCase, BoundsVaryingParameters) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const EmitterDef def{.name = "varies",
                         .seed = seed,
                         .surface = {.kind = SurfaceKind::disc, .radius = 0.2},
                         .release = {.rate = Normal{200, 100},
                                     .count = Uniform{0, 40},
                                     .interval = Uniform{0.05, 0.2},
                                     .bursts = {{.time = 0.5, .count = Normal{400, 100}}}},
                         .particles = {.lifespan = Normal{0.5, 0.3}}};
    const Count real = count(def, 2);
    const WorstCase bound = worst_case(def, 2);
    EXPECT_LE(real.alive, bound.alive);
    EXPECT_LE(real.born, bound.born);
    EXPECT_LT(bound.born, 5 * real.born);
  }
}

TEST(WorstCase, OfDescendantsIsABound) {
  World world = empty_world();
  const auto shells = world.add_particle_system({}), stars = world.add_particle_system({}),
             trail = world.add_particle_system({});
  const EmitterDef shell{.release = {.rate = 20.0}, .particles = {.lifespan = 0.5}};
  const SubEmitterDef burst{.trigger = Trigger::age,
                            .age = 0.4,
                            .release = {.count = 10.0},
                            .particles = {.spread_deg = 30.0, .radius = 0.005, .lifespan = 0.6}};
  const SplitDef split{.count = 2.0, .age = 0.2, .delay = 0.2, .depth = 2};
  const TrailDef tail{.release = {.rate = 50.0},
                      .particles = {.speed = 0.0, .radius = 0.005, .lifespan = 0.3}};
  Emitter emitter(shell, shells);
  SubEmitter sub(burst, shells, stars);
  Splitter splitter(split, stars, stars);
  Trail left(tail, stars, trail);
  uint64_t most_stars = 0, most_left = 0;
  for (int i = 0; i < 480; ++i) {
    run(world, 1.0 / 240, 240, emitter, sub, splitter, left);
    most_stars = std::max<uint64_t>(most_stars, world.particles(stars).size());
    most_left = std::max<uint64_t>(most_left, world.particles(trail).size());
  }
  const WorstCase of_shells = worst_case(shell, 2), of_sub = worst_case(burst, of_shells),
                  of_split = worst_case(split, of_sub, true);
  EXPECT_LE(sub.report().released, of_sub.born);
  EXPECT_LE(splitter.report().released, of_split.born);
  EXPECT_LE(most_stars, of_sub.alive + of_split.alive);
  WorstCase both = of_split;
  both.born += of_sub.born;
  both.alive += of_sub.alive;
  both.at_once += of_sub.at_once;
  both.rate += of_sub.rate;
  const WorstCase of_trail = worst_case(tail, both);
  EXPECT_LE(left.report().released, of_trail.born);
  EXPECT_LE(most_left, of_trail.alive);
  EXPECT_LT(of_trail.alive, 40 * most_left);
}

TEST(WorstCase, Saturates) {
  constexpr uint64_t kAll = std::numeric_limits<uint64_t>::max();
  EmitterDef many{.release = {.rate = Normal{.mean = 1e9, .deviation = 1, .clip = false}},
                  .particles = {.lifespan = 1e9}};
  EXPECT_EQ(worst_case(many, 1e12).born, kAll);
  EXPECT_EQ(worst_case(many, 1e12).alive, many.particles.max_alive);
  const SplitDef split{.count = 1000.0, .age = 1e-3, .delay = 1e-3, .depth = 50, .max_alive = kAll};
  EXPECT_EQ(worst_case(split, {1, 1, 10, 1}, true).alive, kAll);
}

// At the highest rate, the next particle of a cell just touches the previous one and never overlaps it.
TEST(WorstCase, TheHighestClearRateKeepsSinglesApart) {
  EmitterDef def{.surface = {.size = {0.1, 0.1}},
                 .particles = {.speed = Uniform{2, 2}, .radius = 0.01, .lifespan = 1e9}};
  EXPECT_NEAR(highest_clear_rate(def), 25 * 2 / 0.02, 1e-6);
  def.release.rate = highest_clear_rate(def);
  World world = empty_world();
  const auto system = world.add_particle_system({});
  Emitter emitter(def, system);
  run(world, 0.2, 60, emitter);
  const auto& x = world.particles(system).position;
  ASSERT_GT(x.size(), 400u);
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) ASSERT_GE((x[i] - x[j]).norm(), 0.02 - 1e-9);
}

}  // namespace
}  // namespace offstage::effects
