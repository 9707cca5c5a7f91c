/// Motors that move bodies in contact with others. A motor supplies or removes energy, so a change of energy
/// must not make the solver reject its solution.

#include <gtest/gtest.h>

#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

class DrivenContacts : public BothSolvers {
 protected:
  BodyHandle add_load(World& w, const Vec3& position) const {
    return w.add_body({.shape = Box{{0.2, 0.2, 0.2}},
                       .pose = {position, Quat::Identity()},
                       .density = 500,
                       .restitution = 0,
                       .friction = 0.5});
  }
};

TEST_P(DrivenContacts, APlatformOfAnyStrengthLiftsItsLoad) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(def(step));
    const BodyHandle platform = w.add_body({.shape = Box{{1, 0.1, 1}},
                                            .pose = {Vec3(0, 0.05, 0), Quat::Identity()},
                                            .density = 500,
                                            .restitution = 0,
                                            .friction = 0.5});
    JointDef rail{.type = JointType::prismatic, .a = platform, .anchor = Vec3::Zero()};
    rail.axis = Vec3::UnitY();
    rail.motor = {.mode = Motor::Mode::position, .targets = {{0, 0}, {1.5, 0.6}}, .smooth = true};
    w.add_joint(rail);
    const BodyHandle lower = add_load(w, {0.1, 0.2, 0}), upper = add_load(w, {0.12, 0.4, 0});
    const Tally t = run(w, 2, step);
    EXPECT_EQ(t.exact_fallbacks, 0u) << step;
    EXPECT_NEAR(w.body(lower).centre.y(), 0.8, 1e-3) << step;
    EXPECT_NEAR(w.body(upper).centre.y(), 1.0, 1e-3) << step;
  }
}

TEST_P(DrivenContacts, AMotorPressesALoadedArmAgainstItsLimit) {
  World w(def());
  w.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0.5});
  const BodyHandle base = add_load(w, {0, 0.1, 0}), arm = add_load(w, {0.3, 0.1, 0});
  const BodyHandle load = add_load(w, {0, 0.3, 0});
  w.add_joint({.type = JointType::fixed, .a = base, .anchor = Vec3::Zero()});
  w.add_joint({.type = JointType::fixed, .a = load, .b = base, .anchor = {0, 0.2, 0}});
  JointDef hinge{.type = JointType::revolute, .a = arm, .b = base, .anchor = {0.15, 0.1, 0}};
  hinge.axis = Vec3::UnitZ();
  hinge.lower = -0.2;
  hinge.upper = 0.3;
  hinge.motor = {.mode = Motor::Mode::speed, .targets = {{0, 1}}, .max_effort = 50};
  const JointHandle joint = w.add_joint(hinge);
  const Tally t = run(w, 2);
  EXPECT_EQ(t.exact_fallbacks, 0u);
  EXPECT_NEAR(w.joint(joint).coordinate, 0.3, is_exact() ? 1e-6 : 1e-3);
}

// A limit is a stop for motors of any strength, also for those of unlimited effort.
TEST_P(DrivenContacts, AMotorStopsAtTheLimitOfItsJoint) {
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const JointType type : {JointType::revolute, JointType::prismatic})
      for (const Motor::Mode mode : {Motor::Mode::speed, Motor::Mode::position})
        for (const Real restitution : {0.0, 0.5}) {
          World w(weightless(step));
          JointDef joint{.type = type, .a = add_load(w, Vec3::Zero())};
          joint.lower = -0.2;
          joint.upper = 0.3;
          joint.restitution = restitution;
          joint.motor.mode = mode;
          joint.motor.targets = {{0, mode == Motor::Mode::speed ? 2.0 : 0.0}, {2, 2}};
          const JointHandle handle = w.add_joint(joint);
          for (Real time = 0; time < 2 - step / 2; time += step) {
            w.step(step);
            ASSERT_LT(w.joint(handle).coordinate, 0.3 + 1e-5);
          }
          EXPECT_NEAR(w.joint(handle).coordinate, 0.3, 1e-6);
        }
}

TEST_P(DrivenContacts, APlaneThatFollowsKeysCarriesABox) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(def(step));
    BodyDef floor{.shape = Plane{}, .motion = MotionType::kinematic, .restitution = 0, .friction = 0.5};
    floor.track.interpolation = Interpolation::linear;
    for (const auto& [time, height] : {std::pair(0.0, 0.0), {1.0, 0.0}, {3.0, 2.0}})
      floor.track.keys.push_back({.time = time, .pose = {{0, height, 0}, Quat::Identity()}});
    w.add_body(floor);
    const BodyHandle box = add_load(w, {0.3, 0.1, 0});
    run(w, 2.5, step);
    EXPECT_NEAR((w.body(box).centre - Vec3(0.3, 1.6, 0)).norm(), 0, is_exact() ? 1e-9 : 1e-4) << step;
    EXPECT_NEAR(w.body(box).velocity.y(), 1, 1e-6) << step;
  }
}

// The speed of the plate jumps at the ends of sub-steps. The box slides by v^2 / (2 mu g) on it each time.
TEST_P(DrivenContacts, ABoxSlidesOnAPlateThatStartsAndStopsAtOnce) {
  constexpr Real kSpeed = 2, kSlide = kSpeed * kSpeed / (2 * 0.5 * 9.81);
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(def(step));
    BodyDef plate{
        .shape = Box{{8, 0.1, 2}}, .motion = MotionType::kinematic, .restitution = 0, .friction = 0.5};
    plate.track.interpolation = Interpolation::linear;
    for (const auto& [time, x] : {std::pair(0.5, 0.0), {1.5, 2.0}})
      plate.track.keys.push_back({.time = time, .pose = {{x, 0, 0}, Quat::Identity()}});
    w.add_body(plate);
    const BodyHandle box = add_load(w, {0, 0.15, 0});
    run(w, 1.5, step);
    EXPECT_NEAR(w.body(box).centre.x(), 2 - kSlide, 3e-3) << step;
    run(w, 1, step);
    EXPECT_NEAR(w.body(box).centre.x(), 2, 3e-3) << step;
  }
}

// The motor's force is constant in a sub-step. A platform that had its new speed from the sub-step's start on
// would leave its load behind by the acceleration times h^2 / 2 in each sub-step: by 12 mm and 50 mm here.
TEST_P(DrivenContacts, ALoadStaysOnAnAcceleratingPlatform) {
  using enum Motor::Mode;
  for (const Motor::Mode mode : {speed, position})
    for (const Real step : {1.0 / 240, 1.0 / 60}) {
      World w(def(step));
      const BodyHandle platform = w.add_body({.shape = Box{{8, 0.1, 1}},
                                              .pose = {Vec3(0, 0.05, 0), Quat::Identity()},
                                              .density = 500,
                                              .restitution = 0,
                                              .friction = 0.5});
      JointDef rail{.type = JointType::prismatic, .a = platform, .anchor = Vec3::Zero()};
      rail.axis = Vec3::UnitX();
      rail.motor.mode = mode;
      for (int i = 0; i <= 120; ++i) {
        const Real t = i / 60.0, target = mode == speed ? 3 * t : 1.5 * t * t;
        rail.motor.targets.push_back({t, target});
      }
      w.add_joint(rail);
      const BodyHandle lower = add_load(w, {0.1, 0.2, 0}), upper = add_load(w, {0.12, 0.4, 0});
      run(w, 1.99, step);
      const Real moved = w.body(platform).centre.x();
      EXPECT_NEAR(moved, 1.5 * w.time() * w.time(), 1e-3) << step;
      EXPECT_NEAR(w.body(lower).centre.x() - moved, 0.1, 1e-3) << step;
      EXPECT_NEAR(w.body(upper).centre.x() - moved, 0.12, 1e-3) << step;
    }
}

// A contradiction: keys move a body through others that a joint holds to the world. No impulse can move
// these, so none may be computed from the rounding that is left of their mobility.
TEST_P(DrivenContacts, ABodyThatKeysMoveThroughFixedBodiesLeavesThemAtRest) {
  for (int i = 0; i < 24; i += 6) {
    World w(def());
    KeyframeTrack track;
    track.keys = {{0, {Vec3(-1, 1, 0), Quat::Identity()}}, {0.5, {Vec3(1, 1, 0), Quat::Identity()}}};
    w.add_body({.shape = Capsule{0.1, 0.3}, .motion = MotionType::kinematic, .track = track});
    const Pose pose{Vec3(0.1, 1, 0.01 * i), Quat(Eigen::AngleAxisd(0.2 * i, Vec3(0.6, 0.8, 0)))};
    const BodyHandle fixed = w.add_body({.shape = Box{{0.3, 0.4, 0.5}}, .pose = pose});
    w.add_joint({.type = JointType::fixed, .a = fixed, .anchor = Vec3(0, 0.5, 0)});
    while (w.time() < 0.5 - 1e-9) {
      w.step(1.0 / 240);
      ASSERT_LT(w.body(fixed).velocity.norm(), 1e-2) << i << " " << w.time();
    }
    EXPECT_LT((w.body(fixed).pose.position - pose.position).norm(), 1e-3) << i;
  }
}
OFFSTAGE_BOTH_SOLVERS(Solvers, DrivenContacts);

}  // namespace
}  // namespace offstage::sim
