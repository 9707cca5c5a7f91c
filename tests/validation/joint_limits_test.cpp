/// Joints at their limits, and jointed bodies in contact, compared with invariants.

#include <cmath>

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

// Rebounds are traced back to their times, and the motion between them is free. So neither solver nor step
// matters.
class ElasticLimits : public BothSolvers {
 protected:
  /// Runs a world for 20 s. Its energy above `lowest` [J] must stay the same, whatever the step.
  static void keeps_energy(World& w, Real lowest, Real step) {
    const Real before = w.energy().total() - lowest;
    Real least = before, greatest = before;
    uint64_t rebounds = 0;
    for (const Real end = w.time() + 20; w.time() < end - step / 2;) {
      rebounds += w.step(step).impacts.collisions;
      least = std::min(least, w.energy().total() - lowest);
      greatest = std::max(greatest, w.energy().total() - lowest);
    }
    EXPECT_GT(rebounds, 15U) << step;
    EXPECT_LT(greatest, 1.002 * before) << step;
    EXPECT_GT(least, 0.998 * before) << step;
  }
};

TEST_P(ElasticLimits, OfARodKeepItsEnergy) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(def(step));
    const BodyHandle rod = w.add_body({.shape = Box{{0.1, 1, 0.1}},
                                       .pose = {Vec3(0, -0.5, 0)},
                                       .velocity = Vec3(2.5, 0, 0),
                                       .angular_velocity = Vec3(0, 0, 5),
                                       .mass = 1});
    w.add_joint({.type = JointType::revolute, .a = rod, .lower = -0.35, .upper = 0.35, .restitution = 1});
    keeps_energy(w, -9.81 / 2, step);
  }
}

TEST_P(ElasticLimits, OfASledgeKeepItsEnergy) {
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const Real speed : {0.0, 3.0}) {
      World w(def(step));
      const BodyHandle sledge =
          w.add_body({.shape = Box{Vec3::Constant(0.2)}, .velocity = Vec3(0, speed, 0), .mass = 1});
      w.add_joint({.type = JointType::prismatic,
                   .a = sledge,
                   .axis = Vec3::UnitY(),
                   .lower = -0.3,
                   .upper = 0.3,
                   .restitution = 1});
      keeps_energy(w, -0.3 * 9.81, step);
    }
}

TEST_P(ElasticLimits, OfADoublePendulumKeepItsEnergy) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(def(step));
    const auto link = [&](Real depth, Real speed) {
      return w.add_body({.shape = Box{{0.1, 0.5, 0.1}},
                         .pose = {Vec3(0, -depth, 0)},
                         .velocity = Vec3(speed, 0, 0),
                         .angular_velocity = Vec3(0, 0, 4),
                         .mass = 1});
    };
    const BodyHandle upper = link(0.25, 1), lower = link(0.75, 3);
    w.add_joint({.type = JointType::revolute, .a = upper});
    w.add_joint({.type = JointType::revolute,
                 .a = lower,
                 .b = upper,
                 .anchor = Vec3(0, -0.5, 0),
                 .lower = -0.5,
                 .upper = 0.5,
                 .restitution = 1});
    keeps_energy(w, -9.81, step);
  }
}

TEST_P(ElasticLimits, OfAFreeRailKeepItsMomentaAndItsEnergy) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(weightless(step));
    const BodyHandle rail = w.add_body({.shape = Box{{1, 0.1, 0.2}},
                                        .pose = {Vec3(0, 0, 0.3)},
                                        .velocity = Vec3(0.4, 0, 0),
                                        .angular_velocity = Vec3(0.5, 2, 1),
                                        .mass = 2});
    const BodyHandle sledge = w.add_body({.shape = Box{{0.1, 0.2, 0.1}},
                                          .pose = {Vec3(0.15, 0.2, 0.3)},
                                          .velocity = Vec3(1.6, 0, -0.3),
                                          .angular_velocity = Vec3(0.5, 2, 1),
                                          .mass = 0.7,
                                          .collides = false});
    w.add_joint({.type = JointType::prismatic,
                 .a = sledge,
                 .b = rail,
                 .anchor = Vec3(0.15, 0.2, 0.3),
                 .axis = Vec3::UnitX(),
                 .lower = -0.5,
                 .upper = 0.25,
                 .restitution = 1});
    w.step(step);  // settles the joint
    const Momenta before(w);
    keeps_energy(w, 0, step);
    const Momenta after(w);
    EXPECT_LT((after.linear - before.linear).norm(), 1e-10 * before.linear.norm());
    EXPECT_LT((after.angular - before.angular).norm(), 1e-3 * before.angular.norm()) << step;
  }
}

// A sledge falls on its lower limit: the n-th apex has the height h e^(2 n).
TEST_P(ElasticLimits, LetASledgeRiseToTheSquareOfTheRestitution) {
  constexpr Real kHeight = 0.5, kRestitution = 0.7;
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World w(def(step));
    const BodyHandle sledge = w.add_body({.shape = Box{Vec3::Constant(0.2)}, .mass = 1});
    w.add_joint({.type = JointType::prismatic,
                 .a = sledge,
                 .axis = Vec3::UnitY(),
                 .lower = -kHeight,
                 .restitution = kRestitution});
    Real apex = kHeight, fall = std::sqrt(2 * kHeight / 9.81), time = fall;
    for (int n = 0; n < 4; ++n) {
      apex *= kRestitution * kRestitution;
      fall *= kRestitution;
      run(w, time + fall - w.time(), step);
      // The samples are up to half a step from the apex.
      EXPECT_NEAR(w.body(sledge).centre.y() + kHeight, apex, 9.81 / 8 * step * step + 1e-3 * apex) << n;
      time += 2 * fall;
    }
    run(w, 4, step);
    EXPECT_NEAR(w.body(sledge).centre.y(), -kHeight, 1e-4);
    EXPECT_LT(w.body(sledge).velocity.norm(), 1e-3);
  }
}
OFFSTAGE_ALL_SOLVERS(Solvers, ElasticLimits);

OFFSTAGE_BOTH_SOLVERS(Solvers, JointLimits);

class Winches : public BothSolvers {
 protected:
  static constexpr Real kGravity = 9.81, kLength = 2, kAngle = 0.6;

  /// A load of 1 kg that hangs on a rope with a motor and swings, beginning at rest at kAngle [rad].
  struct Swing {
    World world;
    BodyHandle load;

    Real length() const { return world.body(load).centre.norm(); }
    /// Energy relative to the lowest point of a rope of this length [J].
    Real energy(Real length) const { return world.energy().total() + kGravity * length; }
  };
  static Swing swing(Real step, const Motor& motor) {
    Swing s{World(def(step)), {}};
    const Vec3 start = kLength * Vec3(std::sin(kAngle), -std::cos(kAngle), 0);
    s.load = s.world.add_body({.shape = Sphere{0.1}, .pose = {start}, .mass = 1});
    s.world.add_joint({.type = JointType::distance,
                       .a = s.load,
                       .anchor = start,
                       .anchor_b = Vec3::Zero(),
                       .motor = motor});
    return s;
  }
};

// The speed along the rope must not contain a part of the speed across it: the motor would damp the swing.
TEST_P(Winches, LetALoadSwingAsARodDoes) {
  const Motor kMotors[] = {{.mode = Motor::Mode::speed},
                           {.mode = Motor::Mode::position},
                           {.mode = Motor::Mode::position, .stiffness = 1e5, .damping = 10}};
  for (const Motor& motor : kMotors) {
    const bool is_soft = motor.stiffness > 0;
    Swing s = swing(1.0 / 60, motor);
    const Real before = s.energy(kLength);
    run(s.world, 24, 1.0 / 60);
    EXPECT_NEAR(s.length(), kLength, 1e-3);
    // Within the short sub-steps of the fast solver the elastic rope is damped.
    EXPECT_NEAR(s.energy(kLength), before, (is_soft && !is_exact() ? 0.04 : 0.003) * before);
  }
}

// The rope of the length r is wound in or paid out at a constant speed: r theta'' + 2 r' theta' + g sin theta
// = 0, integrated by the midpoint rule in small steps.
TEST_P(Winches, WindALoadThatSwings) {
  for (const Real speed : {-0.1, 0.1}) {
    Swing s = swing(1.0 / 60, {.mode = Motor::Mode::speed, .targets = {{0, speed}}});
    run(s.world, 10, 1.0 / 60);
    // The motor reaches its speed within the first sub-step, by a constant force.
    const auto length = [&](Real time) { return kLength + speed * (time - 0.5 / 60); };
    Eigen::Vector2d y(kAngle, 0);
    const auto rate = [&](Real time, const Eigen::Vector2d& at) {
      return Eigen::Vector2d(at[1], -(2 * speed * at[1] + kGravity * std::sin(at[0])) / length(time));
    };
    constexpr int kParts = 100000;
    constexpr Real kPart = 10.0 / kParts;
    for (int i = 0; i < kParts; ++i) y += kPart * rate((i + 0.5) * kPart, y + kPart / 2 * rate(i * kPart, y));
    const Vec3 at = s.world.body(s.load).centre;
    EXPECT_NEAR(at.norm(), length(10), 1e-3) << speed;
    EXPECT_NEAR(std::atan2(at.x(), -at.y()), y[0], 0.01) << speed;
  }
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Winches);

class SoftMotors : public BothSolvers {
 protected:
  struct Oscillation {
    Real deviation = 0;  ///< greatest deviation from the closed form [m], [rad]
    Real late = 0;       ///< greatest distance from the target in the last second [m], [rad]
  };
  /// Releases a body of 2 kg or 2 kg m^2 at the distance 0.1 from the target of its motor, for 5 s.
  static Oscillation release(JointType type, Real stiffness, Real damping, Real step) {
    World w(weightless(step));
    const BodyHandle body =
        w.add_body({.shape = Box{{0.2, 0.2, 0.2}}, .mass = 2, .inertia = Mat3(2 * Mat3::Identity())});
    JointDef def{.type = type, .a = body, .axis = Vec3::UnitY()};
    def.motor = {
        .mode = Motor::Mode::position, .targets = {{0, 0.1}}, .stiffness = stiffness, .damping = damping};
    const JointHandle joint = w.add_joint(def);
    const Real decay = damping / 4, omega = std::sqrt(std::max(0.0, stiffness / 2 - decay * decay));
    Oscillation o;
    while (w.time() < 5 - step / 2) {
      w.step(step);
      const Real t = w.time(), left = w.joint(joint).coordinate - 0.1;
      const Real wave = std::cos(omega * t) + decay / omega * std::sin(omega * t);
      o.deviation = std::max(o.deviation, std::abs(left + 0.1 * std::exp(-decay * t) * wave));
      if (t > 4) o.late = std::max(o.late, std::abs(left));
    }
    return o;
  }
};

// A motor with a stiffness is a spring: without damping its oscillation keeps the amplitude.
TEST_P(SoftMotors, OscillateAsSprings) {
  for (const JointType type : {JointType::prismatic, JointType::revolute})
    for (const Real step : {1.0 / 240, 1.0 / 60}) {
      const Real angle = 10 * step;  // of the oscillation in a sub-step [rad]
      // The frequency is too small by the fraction angle^2 / 12, which in 5 s is a phase of 50 / 12 angle^2.
      const Real deviation = 0.1 * 50 / 12 * angle * angle;
      const Oscillation free = release(type, 200, 0, step);
      EXPECT_GT(free.late, 0.099) << step;
      EXPECT_LT(free.late, 0.1001) << step;
      EXPECT_LT(free.deviation, 1.2 * deviation) << step;
      EXPECT_LT(release(type, 200, 4, step).deviation, 0.2 * deviation) << step;
    }
}

// Springs and dampers that are stiff over a sub-step come to rest instead of vibrating from step to step.
TEST_P(SoftMotors, SettleIfTheyAreStiff) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    for (const Real stiffness : {1e6, 1e9, 1e12})
      EXPECT_LT(release(JointType::prismatic, stiffness, 0, step).late, 1e-6) << stiffness << " " << step;
    EXPECT_LT(release(JointType::prismatic, 1e4, 1e4, step).late, 0.1 * std::exp(-3.9)) << step;
  }
}
OFFSTAGE_ALL_SOLVERS(Solvers, SoftMotors);

}  // namespace
}  // namespace offstage::sim
