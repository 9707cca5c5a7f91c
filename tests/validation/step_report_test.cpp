/// The report of a step contains all decisions of the engine within it.

#include <gtest/gtest.h>

#include "sim/world.h"
#include "validation/both_solvers.h"

namespace offstage::sim {
namespace {

struct Decisions {
  uint64_t woken = 0, put_to_sleep = 0, speculative_contacts = 0, restitution_suppressed = 0;
  ContactWork exact, fast, impacts;

  void add(const StepReport& r) {
    woken += r.bodies_woken;
    put_to_sleep += r.bodies_put_to_sleep;
    speculative_contacts += r.speculative_contacts;
    restitution_suppressed += r.restitution_suppressed;
    exact.add(r.exact);
    fast.add(r.fast);
    impacts.add(r.impacts);
  }
};

Decisions decisions(World& world, Real seconds) {
  Decisions all;
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
  Decisions d = decisions(world, 2);
  EXPECT_EQ(d.put_to_sleep, 2u);
  EXPECT_EQ(d.woken, 0u);
  world.add_body({.shape = Sphere{0.2}, .pose = {Vec3(0, 3, 0), Quat::Identity()}, .restitution = 0});
  d = decisions(world, 4);
  EXPECT_EQ(d.woken, 2u);
  EXPECT_EQ(d.put_to_sleep, 3u);
}

// 80 boxes with six or more contacts each fall into a pit: many impacts at once.
Decisions reported_heap(SolverKind solver, Real restitution) {
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
  return decisions(world, 2);
}

TEST(StepReport, CountsApproximationsOfEachSolver) {
  const Decisions fast = reported_heap(SolverKind::fast, 0.3);
  EXPECT_GT(fast.speculative_contacts, 0u);
  EXPECT_GT(fast.impacts.cluster_truncated, 0u);
  EXPECT_GT(fast.fast.solves, 0u);
  EXPECT_EQ(fast.exact.solves + fast.exact.over_budget, 0u);
  const Decisions automatic = reported_heap(SolverKind::automatic, 0);
  EXPECT_GT(automatic.exact.solves, 0u);
  EXPECT_GT(automatic.fast.solves, 0u);
  EXPECT_GT(automatic.exact.over_budget, 0u);
  EXPECT_EQ(automatic.impacts.cluster_truncated, 0u) << "nothing bounces";
}

TEST(StepReport, TheExactSolverMakesNoApproximations) {
  World world(WorldDef{.solver = SolverKind::exact});
  add_floor(world, 0.5);
  for (int i = 0; i < 12; ++i)
    world.add_body({.shape = Box{{0.8, 0.8, 0.8}},
                    .pose = {Vec3(0.3 * (i % 2), 1 + i, 0), Quat::Identity()},
                    .restitution = 0.5});
  const Decisions d = decisions(world, 1);
  EXPECT_GT(d.impacts.solves, 0u);
  EXPECT_EQ(d.speculative_contacts, 0u);
  EXPECT_EQ(d.fast.solves, 0u);
}

}  // namespace
}  // namespace offstage::sim
