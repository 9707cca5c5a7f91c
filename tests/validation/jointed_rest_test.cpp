/// Bodies with joints that come to rest on contacts.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

// Near rest, the energy of the error of a contact may be many times the kinetic energy. It is not a failure.
TEST(JointedRest, ADoorThatClosesAgainstAStopReportsNoUnsolvedJoint) {
  for (const SolverKind solver : {SolverKind::exact, SolverKind::fast, SolverKind::automatic})
    for (const Real step : {1.0 / 120, 1.0 / 60}) {
      World world({.max_step = step, .solver = solver});
      const auto fixed = [&](const Vec3& size, const Vec3& place, bool collides) {
        return world.add_body(
            {.shape = Box{size}, .motion = MotionType::static_body, .pose = {place}, .collides = collides});
      };
      const BodyHandle post = fixed({0.1, 2, 0.1}, {0, 1, 0}, false);
      fixed({0.1, 2, 0.1}, {0.7, 1, -0.3}, true);
      const BodyHandle door = world.add_body({.shape = Box{Vec3(0.9, 1.9, 0.05)},
                                              .pose = {Vec3(0.5, 1, 0)},
                                              .velocity = {0, 0, -0.5},
                                              .angular_velocity = {0, 1, 0},
                                              .mass = 20});
      world.add_joint({.type = JointType::revolute,
                       .a = door,
                       .b = post,
                       .anchor = {0, 1, 0},
                       .axis = Vec3::UnitY(),
                       .friction = 2});
      uint64_t unsolved = 0;
      for (int i = 0; i < 240; ++i) unsolved += world.step(1.0 / 60).joints.unsolved;
      EXPECT_EQ(unsolved, 0) << static_cast<int>(solver) << ' ' << step;
      EXPECT_LT(world.body(door).velocity.norm(), 1e-3);
    }
}

// A car on soft springs whose wheels are braked, as it falls from its springs' rest position.
TEST(JointedRest, ABrakedCarOnSoftSpringsFallsAsleep) {
  for (const SolverKind solver : {SolverKind::exact, SolverKind::fast, SolverKind::automatic})
    for (const Real step : {1.0 / 240, 1.0 / 60}) {
      World world({.max_step = step, .solver = solver});
      world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .friction = 0.8});
      const BodyHandle hull =
          world.add_body({.shape = Box{Vec3(0.8, 0.3, 1.8)}, .pose = {Vec3(0, 0.75, 0)}, .mass = 300});
      for (const Real x : {-0.6, 0.6})
        for (const Real z : {-0.7, 0.7}) {
          const Vec3 inner(0.85 * x, 0.3, z), outer(x, 0.3, z);
          const BodyHandle hub =
              world.add_body({.shape = Box{Vec3(0.1, 0.1, 0.1)}, .pose = {inner}, .mass = 10});
          const Quat sideways(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitZ()));
          const BodyHandle wheel = world.add_body(
              {.shape = Cylinder{0.3, 0.15}, .pose = {outer, sideways}, .mass = 15, .friction = 0.8});
          world.add_joint({.type = JointType::prismatic,
                           .a = hub,
                           .b = hull,
                           .anchor = inner,
                           .axis = Vec3::UnitY(),
                           .motor = {.mode = Motor::Mode::position, .stiffness = 8000, .damping = 600}});
          world.add_joint({.type = JointType::revolute,
                           .a = wheel,
                           .b = hub,
                           .anchor = outer,
                           .axis = Vec3::UnitX(),
                           .motor = {.mode = Motor::Mode::speed, .max_effort = 200}});
        }
      for (int i = 0; i < 240; ++i) world.step(1.0 / 60);
      EXPECT_TRUE(world.is_asleep(hull)) << static_cast<int>(solver) << ' ' << step;
      // The springs carry 300 kg: 735.75 N / 8000 N/m each.
      EXPECT_NEAR(world.body(hull).pose.position.y(), 0.75 - 300 * 9.81 / 4 / 8000, 5e-4);
    }
}

}  // namespace
}  // namespace offstage::sim
