/// Particles against bodies through the World.

#include <gtest/gtest.h>

#include "sim/core/rotation.h"
#include "sim/world.h"
#include "tests/meshes.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr Real kFrame = 1.0 / 60;

TEST(ParticleCollision, FastParticlesNeverPassAThinPlateOfAnyShape) {
  World world({.gravity = Vec3::Zero()});
  const MeshHandle mesh = world.add_mesh(box_mesh({4, 0.01, 4}));
  const MeshHandle sheet = world.add_mesh(
      {{Vec3(-2, 0, -2), Vec3(2, 0, -2), Vec3(2, 0, 2), Vec3(-2, 0, 2)}, {{0, 2, 1}, {0, 3, 2}}});
  const std::vector<Shape> plates = {Box{{4, 0.01, 4}}, Cylinder{2.5, 0.01}, MeshShape{mesh},
                                     MeshShape{sheet}, Plane{}};
  for (const Shape& shape : plates) {
    const auto plate =
        world.add_body({.shape = shape, .motion = MotionType::static_body, .restitution = 0.5});
    const auto system = world.add_particle_system({});
    const Scatter random{1};
    for (uint64_t i = 0; i < 2000; ++i)
      world.add_particle(
          system,
          {.position = {random.uniform(i, 0) - 0.5, 1 + random.uniform(i, 1), random.uniform(i, 2) - 0.5},
           .velocity = {random.uniform(i, 3) - 0.5, -300 * random.uniform(i, 4) - 1, 0},
           .radius = 0.002});
    for (int i = 0; i < 10; ++i) world.step(kFrame);
    for (const Vec3& x : world.particles(system).position) ASSERT_GT(x.y(), 0) << "shape " << shape.index();
    world.remove(system);
    world.remove(plate);
  }
}

TEST(ParticleCollision, AFastMovingBodySweepsParticlesAlongAndLeavesNoneBehind) {
  World world({.gravity = Vec3::Zero()});
  world.add_body({.shape = Box{{0.02, 2, 2}},
                  .motion = MotionType::kinematic,
                  .restitution = 0,
                  .track = {.keys = {{0, {Vec3(-2, 0, 0)}}, {0.1, {Vec3(8, 0, 0)}}},
                            .interpolation = Interpolation::linear}});
  const auto system = world.add_particle_system({});
  for (int i = 0; i < 50; ++i)
    world.add_particle(system, {.position = {0.1 * i, 0, 0.01 * i - 0.2}, .radius = 0.005, .restitution = 0});
  StepReport total;
  for (int i = 0; i < 5; ++i) total.particles.ejected += world.step(kFrame).particles.ejected;
  EXPECT_EQ(total.particles.ejected, 0u);
  for (std::size_t i = 0; i < 50; ++i) {
    const Vec3 x = world.particles(system).position[i], v = world.particles(system).velocity[i];
    const Real wall = -2 + 100 * world.time() + 0.01;
    ASSERT_GE(x.x(), wall + 0.005 - 1e-9);
    if (x.x() < wall + 0.006) {
      ASSERT_NEAR(v.x(), 100, 1e-6);
    }
  }
}

TEST(ParticleCollision, RestsOnEveryShapeWithoutSinkingOrDrifting) {
  World world;
  const MeshHandle mesh = world.add_mesh(box_mesh({1, 0.5, 1}));
  const std::vector<Shape> shapes = {Box{{1, 0.5, 1}}, Cylinder{0.5, 0.5}, MeshShape{mesh}};
  const auto system = world.add_particle_system({});
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    world.add_body({.shape = shapes[i],
                    .motion = MotionType::static_body,
                    .pose = {Vec3(3.0 * Real(i), 0, 0)},
                    .restitution = 0});
    world.add_particle(system, {.position = {3.0 * Real(i) + 0.1, 0.6, 0.05}, .restitution = 0.3});
  }
  for (int i = 0; i < 300; ++i) world.step(kFrame);
  const auto resting = world.particles(system).position;
  for (int i = 0; i < 300; ++i) ASSERT_EQ(world.step(kFrame).particles.truncated, 0u);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    EXPECT_NEAR(world.particles(system).position[i].y(), 0.26, 1e-9);
    EXPECT_NEAR((world.particles(system).position[i] - resting[i]).norm(), 0, 1e-12);
    EXPECT_NEAR(world.particles(system).velocity[i].norm(), 0, 1e-9);
  }
}

// s = 1/2 g (sin a - mu cos a) t^2 above the friction angle, zero below it.
TEST(ParticleCollision, CoulombFrictionOnAnIncline) {
  for (Real angle : {0.4, 0.6}) {
    constexpr Real kMu = 0.5;
    World world;
    const Quat tilt(Eigen::AngleAxisd(angle, Vec3::UnitZ()));
    world.add_body({.shape = Plane{},
                    .motion = MotionType::static_body,
                    .pose = {Vec3::Zero(), tilt},
                    .restitution = 0,
                    .friction = kMu});
    const auto system = world.add_particle_system({});
    const Vec3 start = tilt * Vec3(0, 0.01 + 1e-10, 0);
    world.add_particle(system, {.position = start, .radius = 0.01, .restitution = 0, .friction = kMu});
    for (int i = 0; i < 120; ++i) world.step(kFrame);
    const Real t = world.time(), s = (world.particles(system).position[0] - start).norm();
    const Real pull = std::sin(angle) - kMu * std::cos(angle);
    if (pull > 0)
      EXPECT_NEAR(s, 9.81 / 2 * pull * t * t, 0.002 * s);
    else
      EXPECT_LT(s, 1e-6 * t / 10);
  }
}

TEST(ParticleCollision, ComesToRestInACornerWithoutTruncatedSweeps) {
  World world({.wind = {3, 0, 3}});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  for (const Vec3& n : {Vec3(-1, 0, 0), Vec3(0, 0, -1)})
    world.add_body({.shape = Plane{},
                    .motion = MotionType::static_body,
                    .pose = {-n, rotation_between(Vec3::UnitY(), n)}});
  const auto system = world.add_particle_system({.linear_drag = 0.05});
  world.add_particle(system, {.position = {0.5, 0.5, 0.3}, .mass = 0.01, .radius = 0.01, .friction = 0.1});
  for (int i = 0; i < 600; ++i) world.step(kFrame);
  uint64_t truncated = 0;
  for (int i = 0; i < 60; ++i) truncated += world.step(kFrame).particles.truncated;
  EXPECT_EQ(truncated, 0u);
  EXPECT_NEAR((world.particles(system).position[0] - Vec3(0.99, 0.01, 0.99)).norm(), 0, 1e-8);
  EXPECT_NEAR(world.particles(system).velocity[0].norm(), 0, 1e-8);
}

TEST(ParticleCollision, RidesOnATurntableWithoutSlipping) {
  World world;
  world.add_body({.shape = Cylinder{1, 0.2},
                  .motion = MotionType::kinematic,
                  .restitution = 0,
                  .friction = 1,
                  .track = {.spin = {0, 2, 0}}});
  const auto system = world.add_particle_system({});
  world.add_particle(
      system,
      {.position = {0.3, 0.11 + 1e-10, 0}, .velocity = {0, 0, -0.6}, .restitution = 0, .friction = 1});
  for (int i = 0; i < 120; ++i) world.step(kFrame);
  const Vec3 x = world.particles(system).position[0];
  EXPECT_NEAR(x.y(), 0.11, 1e-6);
  EXPECT_NEAR(std::hypot(x.x(), x.z()), 0.3, 1e-3);
  const Real angle = 2 * world.time();
  EXPECT_NEAR((x - Vec3(0.3 * std::cos(angle), x.y(), -0.3 * std::sin(angle))).norm(), 0, 1e-3);
}

TEST(ParticleCollision, IsProjectedOutOfABodyAndCounted) {
  World world({.gravity = Vec3::Zero()});
  world.add_body({.shape = Box{{2, 1, 2}}, .motion = MotionType::static_body});
  const auto system = world.add_particle_system({});
  world.add_particle(system, {.position = {0.2, 0.4, 0}, .radius = 0.05});
  const StepReport report = world.step(kFrame);
  EXPECT_EQ(report.particles.ejected, 1u);
  EXPECT_NEAR((world.particles(system).position[0] - Vec3(0.2, 0.55, 0)).norm(), 0, 1e-9);
  EXPECT_EQ(world.step(kFrame).particles.ejected, 0u);
}

TEST(ParticleCollision, IsRemovedAndCountedIfItCannotBeProjectedOut) {
  World world({.gravity = Vec3::Zero()});
  for (const Vec3& n : {Vec3(0, 1, 0), Vec3(0, -1, 0)})  // the slot is narrower than the particle
    world.add_body({.shape = Plane{},
                    .motion = MotionType::static_body,
                    .pose = {-0.01 * n, rotation_between(Vec3::UnitY(), n)}});
  const auto system = world.add_particle_system({});
  world.add_particle(system, {.radius = 0.05});
  EXPECT_EQ(world.step(kFrame).particles.removed, 1u);
  EXPECT_EQ(world.particle_count(), 0u);
}

TEST(ParticleCollision, DiesOnItsFirstCollisionIfSet) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const auto system = world.add_particle_system({.dies_on_hit = true});
  world.add_particle(system, {.position = {0, 0.02, 0}});
  world.add_particle(system, {.position = {0, 50, 0}});
  uint64_t expired = 0;
  for (int i = 0; i < 10; ++i) expired += world.step(kFrame).particles.expired;
  EXPECT_EQ(expired, 1u);
  EXPECT_EQ(world.particles(system).id, (std::vector<uint64_t>{1}));
}

}  // namespace
}  // namespace offstage::sim
