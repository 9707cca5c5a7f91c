/// A small scene with all kinds of objects gives the same bits for any number of threads, in every repetition
/// and every build. Small scenes of bodies in contact give the same bits in every build.

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "effects/emitter.h"
#include "sim/world.h"
#include "tests/meshes.h"

namespace offstage::effects {
namespace {

using namespace sim;

StateHash run() {
  World world({.wind = {1, 0, 0.5}});
  const MeshHandle torus = world.add_mesh(torus_mesh(0.6, 0.2, 16, 10));
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .friction = 0.3});
  world.add_body({.shape = MeshShape{torus}, .motion = MotionType::static_body, .pose = {Vec3(0, 0.5, 0)}});
  const auto arm = world.add_body({.shape = Box{{1.2, 0.1, 0.1}},
                                   .motion = MotionType::kinematic,
                                   .pose = {Vec3(0, 1.2, 0)},
                                   .track = {.spin = {0, 3, 0}}});
  const auto bob =
      world.add_body({.shape = Cone{0.1, 0.3}, .pose = {Vec3(2, 2, 0)}, .angular_velocity = {1, 2, 3}});
  const auto drops = world.add_particle_system({.linear_drag = 1e-4});
  const auto bead = world.add_particle_system({.integrator = IntegratorKind::rk4});
  const uint64_t id = world.add_particle(bead, {.position = {2, 1.4, 0}, .mass = 0.2});
  world.add_spring(
      {.a = BodyPoint{bob, {0.05, 0.1, 0}}, .b = WorldPoint{{2, 3, 0}}, .stiffness = 80, .damping = 0.5});
  world.add_spring({.a = BodyPoint{bob}, .b = ParticlePoint{bead, id}, .stiffness = 30, .damping = 0.1});
  Emitter emitter(
      {.name = "spray",
       .surface = {.pose = {Vec3(0, 0.05, 0)}, .size = {0.3, 0.3}},
       .body = arm,
       .release = {.rate = Curve{{{0, 200}, {0.5, 3000}}}, .bursts = {{.time = 0.2, .count = 500.0}}},
       .particles = {.speed = Normal{3, 1},
                     .spread_deg = Uniform{0, 40},
                     .radius = Uniform{0.004, 0.01},
                     .lifespan = Normal{0.8, 0.3}}},
      drops);
  for (int i = 0; i < 60; ++i)
    world.step(1.0 / 60, [&](Real start, Real end) { emitter.emit(world, start, end); });
  return world.state_hash();
}

TEST(Determinism, SameHashForAnyNumberOfThreadsAndEveryRepeat) {
  const StateHash expected = run();
  for (std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    for (int repeat = 0; repeat < 2; ++repeat) EXPECT_EQ(run(), expected) << threads << " threads";
  }
}

/// Simulates a box that slides to rest, one that bounces and tumbles, and one that slides off an inclined
/// box. Returns the state hash.
StateHash sliding() {
  World world({.solver = SolverKind::exact});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0.4, .friction = 0.3});
  const Quat slope(0.96, 0, 0, -0.28);  // 32.5 degrees
  world.add_body({.shape = Box{{4, 0.2, 1}},
                  .motion = MotionType::static_body,
                  .pose = {Vec3(0, 1, 3), slope},
                  .friction = 0.4});
  world.add_body({.shape = Box{{0.4, 0.1, 0.3}},
                  .pose = {Vec3(0, 0.05, 0)},
                  .velocity = {3, 0, 1},
                  .angular_velocity = {0, 4, 0}});
  world.add_body({.shape = Box{{0.2, 0.3, 0.1}},
                  .pose = {Vec3(-1, 0.6, -1), Quat(0.9, 0.1, 0.3, 0.3).normalized()},
                  .velocity = {1, -1, 0.5}});
  world.add_body(
      {.shape = Box{Vec3::Constant(0.2)}, .pose = {slope * Vec3(-1, 0.2, 0) + Vec3(0, 1, 3), slope}});
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  return world.state_hash();
}

/// Simulates balls, a box and a capsule that fly into a row of bodies and bounce. Returns the state hash.
StateHash bouncing(SolverKind solver) {
  World world({.solver = solver});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0.7});
  for (int i = 0; i < 4; ++i)
    world.add_body({.shape = i % 2 == 0 ? Shape(Sphere{0.1}) : Shape(Box{Vec3::Constant(0.2)}),
                    .pose = {Vec3(0.25 * i, 0.1, 0)},
                    .restitution = 0.8,
                    .friction = 0.3});
  world.add_body({.shape = Sphere{0.15},
                  .pose = {Vec3(-1, 0.2, 0.02)},
                  .velocity = {8, 0, 0},
                  .angular_velocity = {0, 0, 20}});
  world.add_body({.shape = Capsule{0.08, 0.2},
                  .pose = {Vec3(0.3, 1, 0.05), Quat(0.8, 0.2, 0.1, 0.5).normalized()},
                  .velocity = {0, -3, 0},
                  .restitution = 0.6});
  for (int i = 0; i < 45; ++i) world.step(1.0 / 60);
  return world.state_hash();
}

StateHash heap() {
  World world({.solver = SolverKind::fast});
  const MeshHandle torus = world.add_mesh(torus_mesh(0.12, 0.05, 10, 6));
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
  for (int i = 0; i < 15; ++i) {
    const Shape shapes[] = {Box{{0.2, 0.15, 0.25}}, Cylinder{0.1, 0.2}, Box{Vec3::Constant(0.2)},
                            MeshShape{torus}, Sphere{0.1}};
    world.add_body({.shape = shapes[i % 5],
                    .pose = {Vec3(0.15 * (i % 3), 0.2 + 0.2 * i, 0.1 * (i % 2)),
                             Quat(1, 0.1 * (i % 4), 0.2, 0.05 * i).normalized()},
                    .velocity = {0, -2, 0},
                    .restitution = 0});
  }
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  return world.state_hash();
}

/// Simulates a tilted chain with alternating hinges and ball joints that falls on the ground. Returns the
/// state hash.
StateHash chain(SolverKind solver) {
  World world({.solver = solver});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0.2});
  BodyHandle last;
  for (int i = 0; i < 5; ++i) {
    const BodyHandle link = world.add_body({.shape = Box{{0.3, 0.06, 0.1}},
                                            .pose = {Vec3(0.3 * i, 0.1, 0)},
                                            .velocity = {0.5, 1.5 - 0.7 * i, 0.2}});
    if (i > 0)
      world.add_joint({.type = i % 2 == 0 ? JointType::revolute : JointType::spherical,
                       .a = link,
                       .b = last,
                       .anchor = Vec3(0.3 * i - 0.15, 0.1, 0)});
    last = link;
  }
  for (int i = 0; i < 30; ++i) world.step(1.0 / 60);
  return world.state_hash();
}

// Debug, release and sanitizer builds must all give these hashes. If the physics is changed on purpose, the
// failing test prints the new values.
constexpr const char* kParticles = "8771d8e4d50e37452108071c32eef986";
constexpr const char* kSlidingExact = "22b661293c20ed7ff77ce765768dd992";
constexpr const char* kBouncingExact = "a7878d9ca39d088d9f61d0630fe697b7";
constexpr const char* kBouncingFast = "89180cfb7c5a8d48c25a7e1945536c95";
constexpr const char* kHeapFast = "ac5ff90f7e38e52da7957000b483063e";
constexpr const char* kChainExact = "9f4bb37b9c79b48fa61d029f350a4f73";
constexpr const char* kChainFast = "18b6c5d2cdccd1462d2c5f405b2a3077";

TEST(Determinism, SameHashInEveryBuild) {
  EXPECT_EQ(run().hex(), kParticles);
}

TEST(Determinism, SameHashOfContactsInEveryBuild) {
  EXPECT_EQ(sliding().hex(), kSlidingExact);
  EXPECT_EQ(bouncing(SolverKind::exact).hex(), kBouncingExact);
  EXPECT_EQ(bouncing(SolverKind::fast).hex(), kBouncingFast);
  EXPECT_EQ(heap().hex(), kHeapFast);
  EXPECT_EQ(chain(SolverKind::exact).hex(), kChainExact);
  EXPECT_EQ(chain(SolverKind::fast).hex(), kChainFast);
}

}  // namespace
}  // namespace offstage::effects
