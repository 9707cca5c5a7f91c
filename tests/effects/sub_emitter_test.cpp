#include "effects/sub_emitter.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "births.h"

namespace offstage::effects {
namespace {

using namespace sim;

TEST(SubEmitter, AnAgeTriggersOnceAtItsTime) {
  World world = empty_world();
  const auto shells = world.add_particle_system({}), stars = world.add_particle_system({});
  Emitter emitter({.release = {.rate = 240.0, .end = 0.5}, .particles = {.speed = 10.0, .lifespan = 1e9}},
                  shells);
  SubEmitter burst(
      {.trigger = Trigger::age,
       .age = 0.3333,
       .release = {.count = 4.0, .velocity_percent = 100.0},
       .particles = {.speed = 2.0, .spread_deg = Uniform{0, 180}, .radius = 0.005, .lifespan = 1e9}},
      shells, stars);
  run(world, 2, 24, emitter, burst);
  EXPECT_EQ(burst.report().triggered, 120u);
  const auto births = births_of(world, stars), parents = births_of(world, shells);
  ASSERT_EQ(births.size(), 480u);
  for (std::size_t i = 0; i < births.size(); ++i) {
    const Birth& parent = parents[i / 4];
    ASSERT_NEAR(births[i].time - parent.time, 0.3333, 1e-9);
    ASSERT_NEAR((births[i].position - parent.position - 0.3333 * parent.velocity).norm(), 0, 1e-9);
    ASSERT_NEAR((births[i].velocity - parent.velocity).norm(), 2, 1e-9);
  }
}

TEST(SubEmitter, ADeathTriggersWhereItHappens) {
  World world = empty_world();
  const auto shells = world.add_particle_system({.report_deaths = true}),
             stars = world.add_particle_system({});
  for (int i = 0; i < 10; ++i)
    world.add_particle(shells,
                       {.position = {0, 0, Real(i)}, .velocity = {10, 0, 0}, .lifespan = 0.1 + 0.02 * i});
  SubEmitter burst({.trigger = Trigger::death,
                    .release = {.count = 20.0},
                    .particles = {.speed = 3.0, .spread_deg = 30.0, .radius = 0.005, .lifespan = 1e9}},
                   shells, stars);
  run(world, 1, 60, burst);
  EXPECT_EQ(burst.report().triggered, 10u);
  ASSERT_EQ(burst.report().released, 200u);
  const auto births = births_of(world, stars);
  // The parent's position is known only at the end of the sub-step in which it died.
  constexpr Real kStep = 1.0 / 240, kMargin = 1e-9;
  for (std::size_t i = 0; i < births.size(); ++i) {
    EXPECT_NEAR(births[i].position.x(), 10 * (0.1 + 0.02 * static_cast<Real>(i / 20)),
                (10 + 3) * kStep + kMargin);
    EXPECT_NEAR(births[i].position.z(), static_cast<Real>(i / 20), 3 * kStep + kMargin);
    EXPECT_NEAR(births[i].velocity.norm(), 3, 1e-12);
  }
}

struct Rain {
  StateHash hash;
  OffspringReport report;
  uint64_t hits;
};

/// Simulates drops that create splash particles where they hit the ground.
Rain rain(int threads, const SubEmitterDef& def) {
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const auto drops = world.add_particle_system({.dies_on_hit = true, .report_collisions = true}),
             splash = world.add_particle_system({});
  Emitter emitter({.surface = {.kind = SurfaceKind::disc,
                               .pose = {Vec3(0, 2, 0), Quat(Eigen::AngleAxisd(M_PI, Vec3::UnitX()))},
                               .radius = 3},
                   .release = {.rate = 2000.0},
                   .particles = {.speed = Normal{8, 2}, .radius = Uniform{0.001, 0.002}}},
                  drops);
  SubEmitter splashes(def, drops, splash);
  Rain result{};
  for (int i = 0; i < 24; ++i)
    result.hits += world
                       .step(1.0 / 24,
                             [&](Real start, Real end) {
                               emitter.emit(world, start, end);
                               splashes.emit(world, start, end);
                             })
                       .particles.expired;
  result.hash = world.state_hash();
  result.report = splashes.report();
  return result;
}

const SubEmitterDef kSplash{
    .name = "splash",
    .release = {.probability = 0.5, .count = Uniform{2, 6}},
    .particles = {.speed = Normal{1, 0.3}, .spread_deg = Normal{45, 20}, .radius = 0.0005, .lifespan = 5.0}};

TEST(SubEmitter, SplashesAreTheSameForAnyNumberOfThreads) {
  const Rain reference = rain(1, kSplash);
  EXPECT_GT(reference.report.released, 1000u);
  for (int threads : {2, 4}) EXPECT_EQ(rain(threads, kSplash).hash, reference.hash);
}

TEST(SubEmitter, TriggersByProbabilityUpToItsLimit) {
  const Rain free = rain(2, kSplash);
  const auto hits = static_cast<Real>(free.hits);
  // The collisions of the last sub-step have not been processed yet.
  EXPECT_NEAR(static_cast<Real>(free.report.triggered), hits / 2, 3 * std::sqrt(hits / 4) + 25);
  EXPECT_NEAR(static_cast<Real>(free.report.released) / static_cast<Real>(free.report.triggered), 4, 0.1);
  EXPECT_EQ(free.report.skipped, 0u);

  SubEmitterDef few = kSplash;
  few.release.max_per_step = 3;
  const Rain bounded = rain(2, few);
  EXPECT_GT(bounded.report.skipped, 100u);
  EXPECT_LE(bounded.report.released, 3u * 240);
}

TEST(SubEmitter, EmitsAboutTheNormalFromTheContactPoint) {
  World world({.gravity = Vec3::Zero()});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const auto drops = world.add_particle_system({.dies_on_hit = true, .report_collisions = true}),
             splash = world.add_particle_system({});
  world.add_particle(drops, {.position = {0, 1, 0}, .velocity = {3, -9, 0}, .radius = 0.1});
  SubEmitter splashes({.release = {.count = 100.0},
                       .particles = {.speed = 2.0, .spread_deg = 60.0, .radius = 0.01, .lifespan = 1e9}},
                      drops, splash);
  run(world, 0.2, 60, splashes);
  const auto births = births_of(world, splash);
  ASSERT_EQ(births.size(), 100u);
  for (const Birth& b : births) {
    EXPECT_NEAR(b.time, 0.1, 1e-9);
    EXPECT_NEAR((b.position - Vec3(0.3, 0.01, 0)).norm(), 0, 1e-9);
    EXPECT_NEAR(b.velocity.y(), 2 * std::cos(std::numbers::pi / 3), 1e-12);
  }
}

TEST(SubEmitter, SlowHitsAndImpossibleNumbersAreRefused) {
  SubEmitterDef def = kSplash;
  def.release.min_speed = 1000;
  EXPECT_EQ(rain(2, def).report.triggered, 0u);
  EXPECT_THROW(SubEmitter({.release = {.probability = 1.5}}, {}, {}), std::invalid_argument);
  EXPECT_THROW(SubEmitter({.particles = {.spread_deg = 30.0, .radius = 0.005, .lifespan = 0.0}}, {}, {}),
               std::invalid_argument);
}

}  // namespace
}  // namespace offstage::effects
