/// The report of a step contains all decisions of the engine within it.

#include <gtest/gtest.h>

#include "sim/world.h"
#include "validation/both_solvers.h"

namespace offstage::sim {
namespace {

/// Returns the sum of the reports of all steps in a period.
StepFigures figures_of(World& world, Real seconds) {
  StepFigures all;
  const Real end = world.time() + seconds - 1.0 / 480;
  while (world.time() < end) all.add(world.step(1.0 / 240));
  return all;
}

void add_floor(World& world, Real restitution = 0) {
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = restitution});
}

TEST(StepReport, ListsBodiesThatFellAsleepOrWoke) {
  World world(WorldDef{});
  add_floor(world);
  for (int i = 0; i < 2; ++i)
    world.add_body(
        {.shape = Box{{1, 1, 1}}, .pose = {Vec3(0, 0.5 + i, 0), Quat::Identity()}, .restitution = 0});
  StepFigures d = figures_of(world, 2);
  EXPECT_EQ(d.bodies.put_to_sleep, 2u);
  EXPECT_EQ(d.bodies.woken, 0u);
  world.add_body({.shape = Sphere{0.2}, .pose = {Vec3(0, 3, 0), Quat::Identity()}, .restitution = 0});
  d = figures_of(world, 4);
  EXPECT_EQ(d.bodies.woken, 2u);
  EXPECT_EQ(d.bodies.put_to_sleep, 3u);
}

// 80 boxes with six or more contacts each fall into a pit: many impacts at once.
StepFigures reported_heap(SolverKind solver, Real restitution) {
  World world(WorldDef{.solver = solver});
  add_floor(world, restitution);
  for (int side = 0; side < 4; ++side) {
    const Real x = side == 0 ? 2.5 : side == 1 ? -2.5 : 0, z = side == 2 ? 2.5 : side == 3 ? -2.5 : 0;
    world.add_body({.shape = Box{{x != 0 ? 1.0 : 6.0, 20, z != 0 ? 1.0 : 6.0}},
                    .motion = MotionType::static_body,
                    .pose = {Vec3(x, 10, z), Quat::Identity()},
                    .restitution = restitution});
  }
  for (int i = 0; i < 80; ++i) {
    const Quat turned(Eigen::AngleAxisd(0.3 * i, Vec3(1, i % 3, 0.5).normalized()));
    world.add_body({.shape = Box{{0.8, 0.8, 0.8}},
                    .pose = {Vec3(1.1 * (i % 3 - 1), 1 + 1.3 * (i / 9), 1.1 * (i / 3 % 3 - 1)), turned},
                    .angular_velocity = {3, 1, i % 5 - 2.0},
                    .restitution = restitution});
  }
  return figures_of(world, 2);
}

TEST(StepReport, CountsApproximationsOfEachSolver) {
  const StepFigures fast = reported_heap(SolverKind::fast, 0.3);
  EXPECT_GT(fast.contacts.speculative, 0u);
  EXPECT_GT(fast.solvers.impacts.cluster_truncated, 0u);
  EXPECT_GT(fast.solvers.fast.solves, 0u);
  EXPECT_EQ(fast.solvers.exact.solves + fast.solvers.exact.over_budget, 0u);
  const StepFigures automatic = reported_heap(SolverKind::automatic, 0);
  EXPECT_GT(automatic.solvers.exact.solves, 0u);
  EXPECT_GT(automatic.solvers.fast.solves, 0u);
  EXPECT_GT(automatic.solvers.exact.over_budget, 0u);
  EXPECT_EQ(automatic.solvers.impacts.cluster_truncated, 0u) << "nothing bounces";
}

TEST(StepReport, TheExactSolverMakesNoApproximations) {
  World world(WorldDef{.solver = SolverKind::exact});
  add_floor(world, 0.5);
  for (int i = 0; i < 12; ++i)
    world.add_body({.shape = Box{{0.8, 0.8, 0.8}},
                    .pose = {Vec3(0.3 * (i % 2), 1 + i, 0), Quat::Identity()},
                    .restitution = 0.5});
  const StepFigures d = figures_of(world, 1);
  EXPECT_GT(d.solvers.impacts.solves, 0u);
  EXPECT_EQ(d.contacts.speculative, 0u);
  EXPECT_EQ(d.solvers.fast.solves, 0u);
}

}  // namespace
}  // namespace offstage::sim
