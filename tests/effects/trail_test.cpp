#include "effects/trail.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "births.h"

namespace offstage::effects {
namespace {

using namespace sim;

// A star is created within a sub-step at 80 m/s, and the trail's rate is unrelated to the sub-steps: the
// trail particles are evenly spaced from the first to the last.
TEST(Trail, OfAFastParentIsEven) {
  for (Real step : {1.0 / 240, 1.0 / 24}) {
    World world = empty_world(step);
    const auto stars = world.add_particle_system({}), trail = world.add_particle_system({});
    Emitter emitter({.surface = {.size = {0.001, 0.001}},
                     .release = {.rate = 0.0, .bursts = {{.time = 0.0123, .count = 1.0}}},
                     .particles = {.speed = 80.0, .radius = 0.001, .lifespan = 0.75}},
                    stars);
    Trail left({.release = {.rate = 777.0, .start_age = 0.05},
                .particles = {.speed = 0.0, .radius = 0.005, .lifespan = 1e9}},
               stars, trail);
    run(world, 1, 24, emitter, left);
    const auto births = births_of(world, trail);
    EXPECT_NEAR(static_cast<Real>(births.size()), 777 * 0.7, 1);
    EXPECT_EQ(left.report().released, births.size());
    EXPECT_LE(births[0].position.y(), 80 * (0.05 + 1 / 777.0) + 0.01);
    for (std::size_t i = 1; i < births.size(); ++i) {
      ASSERT_NEAR(births[i].position.y() - births[i - 1].position.y(), 80 / 777.0, 1e-9);
      ASSERT_NEAR(births[i].time - births[i - 1].time, 1 / 777.0, 1e-9);
    }
  }
}

TEST(Trail, StartsAtBirthAndInheritsAFractionOfTheVelocity) {
  World world = empty_world();
  const auto stars = world.add_particle_system({}), trail = world.add_particle_system({});
  Emitter emitter({.release = {.rate = 240.0, .end = 0.25},
                   .particles = {.speed = 20.0, .spread_deg = 40.0, .lifespan = 1e9}},
                  stars);
  Trail left({.release = {.rate = 60.0, .velocity_percent = 25.0},
              .particles = {.speed = 0.0, .radius = 0.005, .lifespan = 1e9}},
             stars, trail);
  run(world, 1, 30, emitter, left);
  // Each star emits sixty times a second from its birth on; the first time of each star is random.
  Real expected = 0;
  for (Real age : world.particles(stars).age) expected += 60 * age;
  const auto n = static_cast<Real>(world.particles(stars).size());
  EXPECT_NEAR(static_cast<Real>(world.particles(trail).size()), expected, 3 * std::sqrt(n / 12) + 1);
  for (const Vec3& v : world.particles(trail).velocity) ASSERT_NEAR(v.norm(), 5, 1e-12);
}

TEST(Trail, IsTheSameAtAnyFrameRate) {
  const auto outcome = [](int fps) {
    World world({.wind = {3, 0, 0}});
    const auto stars = world.add_particle_system({.linear_drag = 1e-3}),
               trail = world.add_particle_system({.linear_drag = 1e-4, .gravity = false});
    Emitter emitter({.surface = {.kind = SurfaceKind::sphere},
                     .release = {.rate = 0.0, .bursts = {{.time = 0.1, .count = 50.0}}},
                     .particles = {.speed = Normal{10, 2}, .lifespan = Normal{1, 0.3}}},
                    stars);
    Trail left({.release = {.rate = Normal{100, 20}},
                .particles = {.speed = 0.1, .spread_deg = Uniform{0, 180}, .radius = 0.005, .lifespan = 1.0}},
               stars, trail);
    run(world, 1, fps, emitter, left);
    return std::pair(world.particles(trail).position, world.particles(trail).velocity);
  };
  const auto reference = outcome(24);
  ASSERT_GT(reference.first.size(), 1000u);
  for (int fps : {30, 60}) {
    const auto other = outcome(fps);
    ASSERT_EQ(other.first.size(), reference.first.size());
    for (std::size_t i = 0; i < other.first.size(); ++i)
      ASSERT_NEAR((other.first[i] - reference.first[i]).norm(), 0, 1e-9);
  }
}

TEST(Trail, HasItsLimits) {
  World world = empty_world();
  const auto stars = world.add_particle_system({}), trail = world.add_particle_system({});
  EXPECT_THROW(Trail({}, stars, stars), std::invalid_argument);
  EXPECT_THROW(Trail({.release = {.rate = Curve{{{0, 1}}}}}, stars, trail), std::invalid_argument);
  world.add_particle(stars, {});
  Trail left({.release = {.rate = 1000.0},
              .particles = {.speed = 0.0, .radius = 0.005, .lifespan = 1e9, .max_alive = 100}},
             stars, trail);
  run(world, 1, 60, left);
  EXPECT_EQ(world.particles(trail).size(), 100u);
  EXPECT_NEAR(static_cast<Real>(left.report().skipped), 900, 1);
}

}  // namespace
}  // namespace offstage::effects
