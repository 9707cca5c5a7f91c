#include "effects/emitter.h"

#include <numbers>

#include <gtest/gtest.h>

namespace offstage::effects {
namespace {

using namespace sim;

/// The state of a particle at its birth time.
struct FirstState {
  Real time;
  Vec3 position, velocity;
  Real radius;
};

/// Births in order. Nothing acts on the particles, so their first state follows from their age.
std::vector<FirstState> births(const EmitterDef& def, Real seconds, int fps, Real max_step = 1.0 / 240,
                               EmitterReport* report = nullptr) {
  World world({.gravity = Vec3::Zero(),
               .max_step = max_step,
               .bounds = Aabb(Vec3::Constant(-1e6), Vec3::Constant(1e6))});
  const auto system = world.add_particle_system({});
  Emitter emitter(def, system);
  const int frames = static_cast<int>(std::lround(seconds * fps));
  for (int i = 0; i < frames; ++i)
    world.step(1.0 / fps, [&](Real start, Real end) { emitter.emit(world, start, end); });
  if (report) *report = emitter.report();
  std::vector<FirstState> out;
  const ParticleArrays& p = world.particles(system);
  for (std::size_t i = 0; i < p.size(); ++i)
    out.push_back(
        {world.time() - p.age[i], p.position[i] - p.age[i] * p.velocity[i], p.velocity[i], p.radius[i]});
  return out;
}

EmitterDef busy() {
  return {.name = "busy",
          .surface = {.size = {1, 1}},
          .release = {.rate = Normal{300, 150},
                      .count = Uniform{3, 9},
                      .interval = Normal{0.07, 0.02},
                      .bursts = {{.time = 0.31, .count = 40.0, .cycles = 3, .interval = 0.21}}},
          .particles = {.speed = Normal{3, 1},
                        .spread_deg = Normal{0, 20},
                        .radius = Uniform{0.01, 0.02},
                        .lifespan = 1e9}};
}

TEST(Emitter, BirthsAndDrawsAreTheSameAtAnyFrameRateAndSubStep) {
  const auto reference = births(busy(), 2, 24);
  ASSERT_GT(reference.size(), 500u);
  for (const auto& [fps, step] :
       {std::pair(30, 1.0 / 240), {60, 1.0 / 240}, {24, 1.0 / 24}, {60, 1.0 / 1000}}) {
    const auto other = births(busy(), 2, fps, step);
    ASSERT_EQ(other.size(), reference.size());
    for (std::size_t i = 0; i < other.size(); ++i) {
      ASSERT_NEAR(other[i].time, reference[i].time, 1e-12) << i;
      ASSERT_NEAR((other[i].position - reference[i].position).norm(), 0, 1e-11) << i;
      ASSERT_EQ(other[i].velocity, reference[i].velocity) << i;
      ASSERT_EQ(other[i].radius, reference[i].radius) << i;
    }
  }
}

TEST(Emitter, AConstantRateGivesExactlyItsCountAtEvenTimes) {
  const auto b = births({.release = {.rate = 100.0}, .particles = {.lifespan = 1e9}}, 3, 60);
  ASSERT_EQ(b.size(), 300u);
  for (std::size_t i = 0; i < b.size(); ++i) ASSERT_NEAR(b[i].time, (Real(i) + 1) / 100, 1e-12);
}

// The rate rises from 0 to 100 in 2 s and falls to 0 at 4 s. Its integral is 50 t^2 / 2 on the way up and 200
// in all; it stays 0 for a second before it rises again.
TEST(Emitter, ACurveOfRatesIsIntegratedExactlyAndZeroDoesNotStall) {
  const auto b = births({.release = {.rate = Curve{{{0, 0}, {2, 100}, {4, 0}, {5, 0}, {5.5, 40}}}},
                         .particles = {.lifespan = 1e9}},
                        6 + 1.0 / 30, 30);
  ASSERT_EQ(b.size(), 231u);
  for (std::size_t k = 0; k < 100; ++k) ASSERT_NEAR(b[k].time, std::sqrt((Real(k) + 1) / 25), 1e-9);
  EXPECT_NEAR(b[198].time, 4 - 0.2, 1e-9);
  EXPECT_NEAR(b[200].time, 5 + std::sqrt(1 / 40.0), 1e-9);
}

TEST(Emitter, ReleasesAndBurstsComeAtTheirTimesWithinTheWindow) {
  const auto b = births({.surface = {.size = {1, 1}},
                         .release = {.rate = 0.0,
                                     .count = 4.0,
                                     .interval = 0.25,
                                     .bursts = {{.time = 0, .count = 7.0, .cycles = 2, .interval = 0.6}},
                                     .start = 0.1,
                                     .end = 0.7},
                         .particles = {.lifespan = 1e9}},
                        2, 24);
  std::vector<std::pair<Real, int>> expected = {{0, 7}, {0.1, 4}, {0.35, 4}, {0.6, 11}};
  std::size_t i = 0;
  for (const auto& [time, count] : expected)
    for (int k = 0; k < count; ++k, ++i) {
      ASSERT_LT(i, b.size());
      EXPECT_NEAR(b[i].time, time, 1e-12);
    }
  EXPECT_EQ(i, b.size());
}

TEST(Emitter, ParticlesOfAReleaseNeverOverlapAndLieOnTheSurface) {
  for (const Varying& radius :
       {Varying(Uniform{0.01, 0.03}),
        Varying(Normal{.mean = 0.02, .deviation = 0.003, .min = 0.001, .clip = false})}) {
    const auto b = births({.surface = {.size = {1.3, 0.7}},
                           .release = {.rate = 0.0, .bursts = {{.count = 200.0}}},
                           .particles = {.speed = 0.0, .radius = radius, .lifespan = 1e9}},
                          0.1, 60);
    ASSERT_EQ(b.size(), 200u);
    for (std::size_t i = 0; i < b.size(); ++i) {
      EXPECT_LE(std::abs(b[i].position.x()), 0.65);
      EXPECT_LE(std::abs(b[i].position.z()), 0.35);
      for (std::size_t j = 0; j < i; ++j) {
        const Vec3 d = b[i].position - b[j].position;
        ASSERT_GE(std::hypot(d.x(), d.z()), b[i].radius + b[j].radius - 1e-12);
      }
    }
  }
}

// A surface of 25 cells and a burst of 70 particles: three releases, each delayed by the time in which the
// particles of the previous one clear their cells.
TEST(Emitter, ParticlesWithoutAFreeCellWaitUntilOneIsClear) {
  EmitterReport report;
  const EmitterDef def = {.surface = {.size = {0.1, 0.1}},
                          .release = {.rate = 0.0, .bursts = {{.count = 70.0}}},
                          .particles = {.speed = 2.0, .radius = 0.01, .lifespan = 1e9}};
  for (Real step : {1.0 / 240, 1.0 / 2000}) {
    const auto b = births(def, 0.1, 60, step, &report);
    ASSERT_EQ(b.size(), 70u);
    for (std::size_t i = 0; i < 70; ++i) EXPECT_NEAR(b[i].time, 0.01 * static_cast<int>(i / 25), 1e-12);
    EXPECT_EQ(report.waited, 45u);
    EXPECT_EQ(report.waiting, 0u);
    EXPECT_EQ(report.released, 70u);
  }
}

TEST(Emitter, TheLimitOfLivingParticlesSkipsAndCounts) {
  EmitterReport report;
  const auto b = births({.surface = {.size = {1, 1}},
                         .release = {.rate = 100.0},
                         .particles = {.lifespan = 1e9, .max_alive = 30}},
                        1, 60, 1.0 / 240, &report);
  EXPECT_EQ(b.size(), 30u);
  EXPECT_EQ(report.skipped, 70u);
}

TEST(Emitter, MovesWithItsBodyAndAddsItsVelocity) {
  World world({.gravity = Vec3::Zero()});
  const auto wheel = world.add_body({.shape = Sphere{0.1},
                                     .motion = MotionType::kinematic,
                                     .pose = {Vec3(0, 5, 0)},
                                     .collides = false,
                                     .track = {.spin = {0, 0, 2}}});
  const auto system = world.add_particle_system({});
  Emitter emitter({.surface = {.pose = {Vec3(1, 0, 0)}, .size = {0.01, 0.01}},
                   .body = wheel,
                   .release = {.rate = 50.0},
                   .particles = {.speed = 3.0, .radius = 0.01, .lifespan = 1e9}},
                  system);
  for (int i = 0; i < 60; ++i)
    world.step(1.0 / 60, [&](Real start, Real end) { emitter.emit(world, start, end); });
  const ParticleArrays& p = world.particles(system);
  ASSERT_EQ(p.size(), 50u);
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Real angle = 2 * (Real(i) + 1) / 50, c = std::cos(angle), s = std::sin(angle);
    // Arm (1, r): the position rotated by the angle. The velocity is w x arm plus the speed along the rotated
    // normal.
    const Vec3 arm(c - 0.01 * s, s + 0.01 * c, 0),
        v = Vec3(-2 * arm.y(), 2 * arm.x(), 0) + 3 * Vec3(-s, c, 0);
    ASSERT_NEAR((p.velocity[i] - v).norm(), 0, 1e-12);
    ASSERT_NEAR((p.position[i] - p.age[i] * v - arm - Vec3(0, 5, 0)).norm(), 0, 1e-12);
  }
}

TEST(Emitter, ReleasesOnlyWhileItsBodyExists) {
  World world({.gravity = Vec3::Zero()});
  const auto system = world.add_particle_system({});
  const BodyHandle body = world.add_body(
      {.shape = Sphere{0.1}, .motion = MotionType::kinematic, .appear_at = 0.5, .remove_at = 1.25});
  Emitter emitter(
      {.body = body,
       .release = {.rate = 100.0, .bursts = {{.time = 0.25, .count = 7.0}, {.time = 0.75, .count = 9.0}}},
       .particles = {.lifespan = 1e9}},
      system);
  for (int i = 0; i < 120; ++i)
    world.step(1.0 / 60, [&](Real start, Real end) { emitter.emit(world, start, end); });
  EXPECT_NEAR(static_cast<Real>(world.particles(system).size()), 75 + 9, 1);
  for (const Real age : world.particles(system).age) EXPECT_LE(age, 1.5 + 1e-9);
}

TEST(Emitter, RefusesInvalidDistributions) {
  const auto message = [](const EmitterDef& def) {
    try {
      Emitter(def, {});
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(message({}), "");
  EXPECT_NE(message({.name = "e", .particles = {.radius = 0.0}}).find("emitter \"e\": radius"),
            std::string::npos);
  EXPECT_NE(message({.particles = {.radius = Normal{.mean = 1, .deviation = 0.1, .clip = false}}})
                .find("give it a min"),
            std::string::npos);
  EXPECT_NE(message({.surface = {.size = {0, 1}}}).find("surface.size"), std::string::npos);
  EXPECT_NE(message({.particles = {.restitution = 1.5}}).find("restitution"), std::string::npos);
  EXPECT_EQ(message({.particles = {.restitution = Normal{0.9, 0.2}}}), "");  // truncated at 1
  EXPECT_NE(message({.release = {.rate = Curve{}}}).find("without keys"), std::string::npos);
}

}  // namespace
}  // namespace offstage::effects
