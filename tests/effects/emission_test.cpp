/// When and where emitters release particles: time windows, prewarming, stopping, moving bodies.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "births.h"
#include "meshes.h"

namespace offstage::effects {
namespace {

using namespace sim;

TEST(Emission, DrawsAreTheSameBitsAtAnyFrameRateOnEverySurface) {
  for (const SurfaceKind kind : {SurfaceKind::sphere, SurfaceKind::disc, SurfaceKind::mesh}) {
    const EmitterDef def{
        .name = "busy",
        .surface = {.kind = kind, .radius = 0.3, .mesh = torus_mesh(0.5, 0.2, 16, 8)},
        .release = {.rate = Normal{300, 150},
                    .count = Uniform{3, 9},
                    .interval = Normal{0.07, 0.02},
                    .bursts = {{.time = 0.31, .count = 150.0, .cycles = 3, .interval = 0.21}},
                    .windows = {{0.1, 0.5}, {0.9, 1.7}},
                    .prewarm = 0.2},
        .particles = {.speed = Normal{3, 1},
                      .spread_deg = Normal{0, 20},
                      .radius = Uniform{0.01, 0.03},
                      .lifespan = 1e9,
                      .charge = Normal{1e-6, 1e-7}}};
    const auto at = [&](int fps, Real max_step) {
      World world = empty_world(max_step);
      const auto system = world.add_particle_system({});
      Emitter emitter(def, system, 0.5);
      run(world, 2, fps, emitter);
      return std::pair(births_of(world, system), world.particles(system).charge);
    };
    const auto [reference, charges] = at(24, 1.0 / 240);
    ASSERT_GT(reference.size(), 500u);
    for (const auto& [fps, step] : {std::pair(30, 1.0 / 240), {60, 1.0 / 240}, {60, 1.0 / 1000}}) {
      const auto [other, other_charges] = at(fps, step);
      ASSERT_EQ(other.size(), reference.size());
      EXPECT_EQ(other_charges, charges);
      for (std::size_t i = 0; i < other.size(); ++i) {
        ASSERT_EQ(other[i].velocity, reference[i].velocity);
        ASSERT_EQ(other[i].radius, reference[i].radius);
        ASSERT_NEAR(other[i].time, reference[i].time, 1e-11);
        ASSERT_NEAR((other[i].position - reference[i].position).norm(), 0, 1e-10);
      }
    }
  }
}

TEST(Emission, WindowsOpenAndCloseWithoutShiftingTheTimes) {
  World world = empty_world();
  const auto system = world.add_particle_system({});
  Emitter emitter(
      {.release = {.rate = 10.0, .windows = {{0.45, 1.0}, {1.5, 1.75}}}, .particles = {.lifespan = 1e9}},
      system);
  run(world, 2, 30, emitter);
  std::vector<Real> times;
  for (const Birth& b : births_of(world, system)) times.push_back(b.time);
  const std::vector<Real> expected = {0.5, 0.6, 0.7, 0.8, 0.9, 1.5, 1.6, 1.7};
  ASSERT_EQ(times.size(), expected.size());
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], expected[i], 1e-12);
}

// One emitter starts 2 s after the world but is prewarmed by 1.5 s, so it acts like one that starts at 0.5 s.
TEST(Emission, APrewarmedEmitterEqualsOneThatStartedEarlier) {
  World world = empty_world();
  const auto warm = world.add_particle_system({}), early = world.add_particle_system({});
  EmitterDef def{.release = {.rate = 100.0},
                 .particles = {.spread_deg = Normal{0, 30}, .lifespan = 1.2, .max_alive = 1'000'000}};
  def.release.prewarm = 1.5;
  Emitter prewarmed(def, warm, 2);
  def.release.prewarm = 0;
  def.release.start = 0.5;
  Emitter started(def, early);
  run(world, 2, 60, prewarmed, started);
  EXPECT_NEAR(static_cast<Real>(world.particles(warm).size()), 120, 1);
  EXPECT_EQ(world.particles(warm).position, world.particles(early).position);
}

// In the first picture there is rain of every age, from top to bottom.
TEST(Emission, PrewarmedParticlesHaveMovedByTheStart) {
  World world({.gravity = Vec3(0, -10, 0)});
  const auto system = world.add_particle_system({});
  Emitter emitter({.release = {.direction = Vec3::UnitX(), .rate = 100.0, .prewarm = 2},
                   .particles = {.speed = 1.0, .lifespan = 1e9}},
                  system);
  run(world, 1.0 / 60, 60, emitter);
  const auto& p = world.particles(system);
  EXPECT_NEAR(static_cast<Real>(p.size()), 201, 2);
  EXPECT_NEAR(*std::ranges::max_element(p.age), 2, 0.03);
  for (std::size_t i = 0; i < p.size(); ++i) {
    EXPECT_NEAR(p.position[i].x(), p.age[i], 0.12);
    EXPECT_NEAR(p.position[i].y(), -5 * p.age[i] * p.age[i], 0.12);
  }
}

TEST(Emission, StoppingEndsReleasesAndKeepsLivingParticles) {
  World world = empty_world();
  const auto system = world.add_particle_system({});
  Emitter emitter({.surface = {.size = {0.01, 0.01}},
                   .release = {.rate = 100.0, .bursts = {{.time = 0.4, .count = 1000.0}}},
                   .particles = {.lifespan = 1e9}},
                  system);
  run(world, 0.5, 60, emitter);
  const uint64_t released = emitter.report().released;
  EXPECT_GT(emitter.report().waiting, 500u);
  emitter.stop(world.time());
  run(world, 5, 60, emitter);
  EXPECT_EQ(emitter.report().released, released);
  EXPECT_EQ(emitter.report().waiting, 0u);
  EXPECT_EQ(world.particle_count(), released);
}

// An emitter that moves at 20 m/s, with a rate unrelated to the sub-steps, leaves equal gaps along its path.
// An emitter moved once per sub-step would leave clumps 8 cm apart.
TEST(Emission, AMovingEmitterLeavesNoClumps) {
  for (const MotionType type : {MotionType::kinematic, MotionType::dynamic}) {
    World world = empty_world();
    const auto body = world.add_body(
        {.shape = Sphere{0.05},
         .motion = type,
         .velocity = {20, 0, 0},
         .collides = false,
         .track = {.keys = {{0, {}}, {10, {Vec3(200, 0, 0)}}}, .interpolation = Interpolation::linear}});
    const auto system = world.add_particle_system({.linear_drag = 0});
    Emitter emitter({.surface = {.size = {0.001, 0.001}},
                     .body = body,
                     .release = {.rate = 1111.0},
                     .particles = {.speed = 0.0, .radius = 0.001, .lifespan = 1e9}},
                    system);
    run(world, 1, 24, emitter);
    const auto births = births_of(world, system);
    ASSERT_EQ(births.size(), 1111u);
    for (std::size_t i = 1; i < births.size(); ++i) {
      ASSERT_NEAR(births[i].position.x() - births[i - 1].position.x(), 20 / 1111.0, 1e-9);
      ASSERT_NEAR((births[i].velocity - Vec3(20, 0, 0)).norm(), 0, 1e-9);
    }
  }
}

TEST(Emission, MassAndChargeHaveTheirMeansAndDeviations) {
  World world = empty_world();
  const auto system = world.add_particle_system({});
  constexpr int kN = 100'000;
  Emitter emitter({.surface = {.kind = SurfaceKind::sphere, .radius = 5},
                   .release = {.overlap = true, .rate = 0.0, .bursts = {{.count = Real(kN)}}},
                   .particles = {.density = Uniform{500, 1500},
                                 .lifespan = 1e9,
                                 .charge = Normal{.mean = 2e-6, .deviation = 1e-6, .clip = false}}},
                  system);
  run(world, 1.0 / 60, 60, emitter);
  const ParticleArrays& p = world.particles(system);
  ASSERT_EQ(p.size(), std::size_t{kN});
  Real mass = 0, charge = 0, charge2 = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    mass += p.mass[i];
    charge += p.charge[i] * 1e6;
    charge2 += std::pow(p.charge[i] * 1e6 - 2, 2);
  }
  const Real volume = 4 * M_PI / 3 * 1e-6, n = kN;
  EXPECT_NEAR(mass / n / volume, 1000, 3 * 1000 / std::sqrt(12 * n));
  EXPECT_NEAR(charge / n, 2, 3 / std::sqrt(n));
  EXPECT_NEAR(charge2 / n, 1, 3 * std::sqrt(2 / n));
}

}  // namespace
}  // namespace offstage::effects
