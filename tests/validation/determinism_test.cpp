/// One small scene with everything in it: the same bits for any number of threads, in every repeat and every
/// build.

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
  world.add_body({.shape = Plane{}, .motion = MotionType::fixed, .friction = 0.3});
  world.add_body({.shape = MeshShape{torus}, .motion = MotionType::fixed, .pose = {Vec3(0, 0.5, 0)}});
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
  Emitter emitter({.name = "spray",
                   .surface = {.pose = {Vec3(0, 0.05, 0)}, .size = {0.3, 0.3}},
                   .body = arm,
                   .rate = Curve{{{0, 200}, {0.5, 3000}}},
                   .bursts = {{.time = 0.2, .count = 500.0}},
                   .speed = Normal{3, 1},
                   .spread_deg = Uniform{0, 40},
                   .radius = Uniform{0.004, 0.01},
                   .lifespan = Normal{0.8, 0.3}},
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

// Debug, release and sanitizer builds must all give this. It changes when the physics does, and then on
// purpose.
TEST(Determinism, SameHashInEveryBuild) {
  EXPECT_EQ(run().hex(), "76663b32c7063632965d2665316aa918");
}

}  // namespace
}  // namespace offstage::effects
