/// The book's contact forces at each step (physics R8, R9): islands that it solves itself, islands that it
/// leaves to the exact solver, and the difference of its friction pyramid from Coulomb's cone.

#include <cmath>
#include <numbers>

#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

World lcp_world() {
  return World({.solver = SolverKind::lcp, .sleep = false});
}

BodyHandle add_lcp_floor(World& world, Real friction = 0.5) {
  return world.add_body({.shape = Plane{},
                         .motion = MotionType::static_body,
                         .restitution = 0,
                         .friction = friction,
                         .static_friction = friction});
}

BodyHandle add_lcp_box(World& world, const Vec3& centre, Real friction = 0.5) {
  return world.add_body({.shape = Box{Vec3::Constant(0.2)},
                         .pose = {centre},
                         .restitution = 0,
                         .friction = friction,
                         .static_friction = friction});
}

// A box that starts with the speed v stops after v^2 / (2 mu g) by Coulomb's law. The pyramid has its edges
// along the tangents of the contact's frame. Along an edge of the pyramid both tangents have their greatest
// force, so the box stops after 1 / sqrt(2) of that way.
TEST(LcpSolver, StopsEarlierByTheSquareRootOfTwoAcrossThePyramid) {
  constexpr Real kSpeed = 2, kMu = 0.5;
  const Real expected = kSpeed * kSpeed / (2 * kMu * 9.81);
  for (const Real degrees : {0.0, 45.0}) {
    for (const SolverKind solver : {SolverKind::lcp, SolverKind::exact}) {
      World world({.solver = solver, .sleep = false});
      add_lcp_floor(world, kMu);
      const BodyHandle box = add_lcp_box(world, {0, 0.1, 0}, kMu);
      const Real a = degrees * std::numbers::pi / 180;
      world.set_velocity(box, kSpeed * Vec3(std::cos(a), 0, std::sin(a)), Vec3::Zero());
      const Tally t = run(world, 1);
      const Real way = Vec3(world.body(box).centre - Vec3(0, 0.1, 0)).norm();
      const bool across = solver == SolverKind::lcp && degrees == 45;
      EXPECT_NEAR(way / expected, across ? std::numbers::sqrt2 / 2 : 1, 0.02)
          << degrees << solver_name({solver, 0});
      EXPECT_EQ(t.lcp_fallbacks, 0u);
      EXPECT_EQ(t.lcp_solves > 0, solver == SolverKind::lcp);
    }
  }
}

// Stacks and hinged links with limits and motors are solved only by pivoting.
TEST(LcpSolver, SolvesStacksAndJointsWithoutFallbacks) {
  World world = lcp_world();
  add_lcp_floor(world);
  for (int i = 0; i < 5; ++i) add_lcp_box(world, {0, 0.1 + 0.2 * i, 0});
  const BodyHandle base = add_lcp_box(world, {2, 0.1, 0}), arm = add_lcp_box(world, {2.3, 0.1, 0}),
                   load = add_lcp_box(world, {2, 0.3, 0});
  world.add_joint({.type = JointType::fixed, .a = base, .anchor = {2, 0, 0}});
  world.add_joint({.type = JointType::fixed, .a = load, .b = base, .anchor = {2, 0.2, 0}});
  JointDef hinge{.type = JointType::revolute, .a = arm, .b = base, .anchor = {2.15, 0.1, 0}};
  hinge.axis = Vec3::UnitZ();
  hinge.lower = -0.2;
  hinge.upper = 0.3;
  hinge.motor = {.mode = Motor::Mode::speed, .targets = {{0, 1}}, .max_effort = 50};
  const JointHandle joint = world.add_joint(hinge);
  const Tally t = run(world, 2);
  EXPECT_GT(t.lcp_solves, 400u);
  EXPECT_EQ(t.lcp_fallbacks, 0u);
  EXPECT_EQ(t.exact_fallbacks, 0u);
  EXPECT_GT(t.last.solvers.lcp.iterations, 10u);
  EXPECT_EQ(t.last.solvers.exact.solves, 0u);
  EXPECT_NEAR(world.joint(joint).coordinate, 0.3, 1e-6);
}

// Islands of too many contacts are solved by the exact solver, to the same bits, and counted.
TEST(LcpSolver, HandsLargeIslandsToTheExactSolver) {
  const auto state = [](SolverKind solver, Tally& tally) {
    World world({.solver = solver, .sleep = false});
    add_lcp_floor(world);
    for (int i = 0; i < 17; ++i) add_lcp_box(world, {0, 0.1 + 0.2 * i, 0});
    tally = run(world, 0.1);
    return world.state_hash().hex();
  };
  Tally lcp, exact;
  EXPECT_EQ(state(SolverKind::lcp, lcp), state(SolverKind::exact, exact));
  EXPECT_GT(lcp.lcp_fallbacks, 20u);
  EXPECT_EQ(lcp.lcp_fallbacks, lcp.lcp_solves);
  EXPECT_EQ(exact.lcp_solves, 0u);
}

}  // namespace
}  // namespace offstage::sim
