/// Joints at their limits, and jointed bodies in contact, compared with invariants.

#include <gtest/gtest.h>

#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

struct Momenta {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();

  explicit Momenta(const World& world) {
    world.for_each_body([&](BodyHandle handle) {
      const BodyState s = world.body(handle);
      linear += s.mass * s.velocity;
      angular += s.centre.cross(s.mass * s.velocity) + s.angular_momentum;
    });
  }
};

class JointLimits : public BothSolvers {};

// The rotation drives the sledge along its rail to the end, where it stays. Both are off their common centre,
// so that an impulse at a wrong place changes the angular momentum.
TEST_P(JointLimits, KeepAngularMomentum) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(weightless(step));
    const BodyHandle rail = w.add_body({.shape = Box{{1, 0.1, 0.2}},
                                        .pose = {Vec3(0, 0, 0.3), Quat::Identity()},
                                        .velocity = Vec3(0.4, 0, 0),
                                        .angular_velocity = Vec3(0.5, 6, 1),
                                        .mass = 2});
    const BodyHandle sledge = w.add_body({.shape = Box{{0.1, 0.2, 0.1}},
                                          .pose = {Vec3(0.15, 0.2, 0.3), Quat::Identity()},
                                          .velocity = Vec3(0.6, 0, -0.9),
                                          .angular_velocity = Vec3(0.5, 6, 1),
                                          .mass = 0.7,
                                          .collides = false});
    const JointHandle joint = w.add_joint({.type = JointType::prismatic,
                                           .a = sledge,
                                           .b = rail,
                                           .anchor = Vec3(0.15, 0.2, 0.3),
                                           .axis = Vec3::UnitX(),
                                           .lower = -0.5,
                                           .upper = 0.25});
    w.step(step);  // settles the joint
    const Momenta before(w);
    run(w, 3, step);
    EXPECT_NEAR(w.joint(joint).coordinate, 0.25, 5e-3) << "the sledge is at the end of its rail";
    const Momenta after(w);
    EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
    // The error is of second order in the angle of a step: 6e-4 and 1e-2. An error of first order would be
    // 1e-2 and 6e-2.
    const Real turn = 6.1 * step;
    EXPECT_LT((after.angular - before.angular).norm(), turn * turn * before.angular.norm()) << step;
  }
}

// The buffer carries a body of a thousand times its mass.
TEST_P(JointLimits, AHeavyBodyBehindALightLinkStopsAtAWall) {
  World w(weightless());
  w.add_body({.shape = Box{{1, 2, 2}},
              .motion = MotionType::static_body,
              .pose = {Vec3(0.5, 0, 0), Quat::Identity()},
              .restitution = 0});
  const BodyHandle buffer = w.add_body({.shape = Box{{0.1, 0.1, 0.1}},
                                        .pose = {Vec3(-0.1, 0, 0), Quat::Identity()},
                                        .velocity = Vec3(2, 0, 0),
                                        .mass = 0.05,
                                        .restitution = 0});
  const BodyHandle wagon = w.add_body({.shape = Box{{0.5, 0.4, 0.4}},
                                       .pose = {Vec3(-0.6, 0, 0), Quat::Identity()},
                                       .velocity = Vec3(2, 0, 0),
                                       .mass = 50,
                                       .restitution = 0});
  w.add_joint({.type = JointType::fixed, .a = buffer, .b = wagon, .anchor = Vec3(-0.15, 0, 0)});
  const Tally all = run(w, 1);
  EXPECT_LT(all.penetration, 1e-3);
  EXPECT_LT(w.body(wagon).velocity.norm(), 1e-2);
}

OFFSTAGE_BOTH_SOLVERS(Solvers, JointLimits);

}  // namespace
}  // namespace offstage::sim
