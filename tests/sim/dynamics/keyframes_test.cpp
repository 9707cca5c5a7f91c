#include "sim/dynamics/keyframes.h"

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

KeyframeTrack track(Interpolation interpolation, bool loop) {
  const auto turn = [](Real angle) { return Quat(Eigen::AngleAxisd(angle, Vec3(1, 2, 3).normalized())); };
  return {.keys = {{0, {Vec3(0, 0, 0), turn(0)}},
                   {0.5, {Vec3(1, 2, 0), turn(1)}},
                   {2, {Vec3(3, -1, 1), turn(-0.5)}},
                   {2.7, {Vec3(0, 0, 0), turn(0)}}},
          .interpolation = interpolation,
          .loop = loop,
          .spin = {0.3, -2, 1}};
}

TEST(Keyframes, PassThroughTheKeys) {
  for (auto kind :
       {Interpolation::monotone, Interpolation::smooth, Interpolation::linear, Interpolation::step}) {
    KeyframeTrack t = track(kind, false);
    t.spin.setZero();
    for (const Keyframe& k : t.keys) {
      const Pose p = t.at(k.time, {}).pose;
      EXPECT_NEAR((p.position - k.pose.position).norm(), 0, 1e-14);
      EXPECT_NEAR(p.orientation.angularDistance(k.pose.orientation), 0, 1e-7);
    }
  }
}

// Compared with central differences of the pose, whose error is of order d^2.
TEST(Keyframes, VelocitiesAreTheDerivativeOfThePose) {
  constexpr Real kD = 1e-5;
  for (auto kind :
       {Interpolation::monotone, Interpolation::linear, Interpolation::smooth, Interpolation::step})
    for (bool loop : {false, true}) {
      const KeyframeTrack t = track(kind, loop);
      for (Real time : {0.1, 0.49, 0.7, 1.9, 2.3, 3.3, 7.1}) {
        const Motion m = t.at(time, {}), before = t.at(time - kD, {}), after = t.at(time + kD, {});
        EXPECT_NEAR((m.velocity - (after.pose.position - before.pose.position) / (2 * kD)).norm(), 0, 1e-7);
        const Eigen::AngleAxisd turn(after.pose.orientation * before.pose.orientation.conjugate());
        EXPECT_NEAR((m.angular_velocity - turn.angle() / (2 * kD) * turn.axis()).norm(), 0, 1e-7);
      }
    }
}

TEST(Keyframes, VelocityIsContinuousAtKeysAndAcrossTheLoop) {
  for (auto kind : {Interpolation::monotone, Interpolation::smooth}) {
    const KeyframeTrack t = track(kind, true);
    for (Real key : {0.5, 2.0, 2.7})
      EXPECT_NEAR((t.at(key - 1e-9, {}).velocity - t.at(key + 1e-9, {}).velocity).norm(), 0, 1e-6);
  }
}

TEST(Keyframes, TurnsAboutOneAxisFollowTheCurveOfPositions) {
  for (auto kind : {Interpolation::monotone, Interpolation::smooth, Interpolation::linear}) {
    KeyframeTrack t{.keys = {}, .interpolation = kind};
    const Vec3 axis = Vec3(1, 2, -2) / 3;
    for (const auto& [time, angle] : {std::pair(0.0, 0.0), {1.0, 0.5}, {2.5, 0.5}, {3.0, -1.0}, {4.0, 1.5}})
      t.keys.push_back({time, {Vec3(angle, 0, 0), Quat(Eigen::AngleAxisd(angle, axis))}});
    for (Real time = 0.05; time < 4; time += 0.1) {
      const Motion m = t.at(time, {});
      EXPECT_NEAR(m.pose.orientation.angularDistance(Quat(Eigen::AngleAxisd(m.pose.position.x(), axis))), 0,
                  1e-7);
      EXPECT_NEAR((m.angular_velocity - m.velocity.x() * axis).norm(), 0, 1e-12);
    }
  }
}

TEST(Keyframes, AngularVelocityIsContinuousAtKeysOfDifferentAxes) {
  for (auto kind : {Interpolation::monotone, Interpolation::smooth}) {
    KeyframeTrack t{.keys = {}, .interpolation = kind, .loop = true};
    const Vec3 turns[] = {{0, 0, 0}, {1, 0.3, 0}, {0.5, 1.8, -1}, {-1, 2.5, 0.2}, {0, 0, 0}};
    for (int k = 0; k < 5; ++k)
      t.keys.push_back(
          {0.5 * k, {Vec3::Zero(), Quat(Eigen::AngleAxisd(turns[k].norm(), turns[k].stableNormalized()))}});
    for (Real key : {0.5, 1.0, 1.5, 2.0})
      EXPECT_NEAR((t.at(key - 1e-9, {}).angular_velocity - t.at(key + 1e-9, {}).angular_velocity).norm(), 0,
                  1e-6);
    constexpr Real kD = 1e-5;
    for (Real time : {0.1, 0.7, 1.3, 1.9}) {
      const Quat before = t.at(time - kD, {}).pose.orientation, after = t.at(time + kD, {}).pose.orientation;
      const Eigen::AngleAxisd turn(after * before.conjugate());
      EXPECT_NEAR((t.at(time, {}).angular_velocity - turn.angle() / (2 * kD) * turn.axis()).norm(), 0, 1e-7);
    }
  }
}

TEST(Keyframes, SmoothMotionReproducesAParabolaOverUnevenKeys) {
  KeyframeTrack t;
  const auto position = [](Real x) { return Vec3(x * x, 3 * x, 1 - 2 * x * x); };
  for (Real x : {0.0, 0.3, 1.0, 1.4, 3.0}) t.keys.push_back({x, {position(x)}});
  for (Real x : {0.35, 0.7, 1.2}) EXPECT_NEAR((t.at(x, {}).pose.position - position(x)).norm(), 0, 1e-14);
}

// A cubic spline through "hold for 5 s, then move 3 m in 0.1 s" would overshoot to -21.8 m.
TEST(Keyframes, AComponentStaysBetweenItsKeysAndHoldsWhereTheyAreEqual) {
  const KeyframeTrack t{.keys = {{0, {Vec3(0, 0, 0)}},
                                 {5, {Vec3(0, 1, 0)}},
                                 {5.1, {Vec3(3, 1, -2)}},
                                 {8, {Vec3(3, 2, 0.5)}},
                                 {9, {Vec3(2.9, 7, 0.5)}}}};
  for (std::size_t k = 0; k + 1 < t.keys.size(); ++k) {
    const Keyframe &from = t.keys[k], &to = t.keys[k + 1];
    Vec3 before = from.pose.position;
    for (int i = 1; i <= 200; ++i) {
      const Motion m = t.at(from.time + (to.time - from.time) * i / 200, {});
      for (int c = 0; c < 3; ++c) {
        const Real way = to.pose.position[c] - from.pose.position[c];
        EXPECT_GE((m.pose.position[c] - before[c]) * (way < 0 ? -1 : 1), -1e-12) << k << ' ' << c;
        EXPECT_GE(m.velocity[c] * (way < 0 ? -1 : 1), -1e-12);
        if (way == 0) {
          EXPECT_EQ(m.pose.position[c], from.pose.position[c]);
        }
      }
      before = m.pose.position;
    }
  }
}

TEST(Keyframes, AKeyCanChooseItsOwnInterpolation) {
  KeyframeTrack t{
      .keys = {{0, {Vec3(0, 0, 0)}, Interpolation::linear},
               {1, {Vec3(1, 0, 0), Quat(Eigen::AngleAxisd(1, Vec3::UnitY()))}, Interpolation::step},
               {2, {Vec3(5, 0, 0)}},
               {3, {Vec3(6, 0, 0)}}}};
  EXPECT_DOUBLE_EQ(t.at(0.25, {}).pose.position.x(), 0.25);
  EXPECT_EQ(t.at(1.999, {}).pose.position.x(), 1);
  EXPECT_EQ(t.at(1.999, {}).pose.orientation.coeffs(), t.keys[1].pose.orientation.coeffs());
  EXPECT_TRUE(t.at(1.5, {}).velocity.isZero(0) && t.at(1.5, {}).angular_velocity.isZero(0));
  EXPECT_EQ(t.at(2, {}).pose.position.x(), 5);
  EXPECT_TRUE(t.jumps(1.9, 2.1));
  EXPECT_FALSE(t.jumps(0.9, 1.1));
  EXPECT_FALSE(t.jumps(2, 2.5));
  t.loop = true;
  EXPECT_TRUE(t.jumps(2.9, 3.1));  // between the last key and the first
  EXPECT_TRUE(t.jumps(4.9, 5.1));
}

TEST(Keyframes, HoldTheEndsAndRestWithoutKeys) {
  KeyframeTrack t = track(Interpolation::smooth, false);
  t.spin.setZero();
  EXPECT_EQ(t.at(99, {}).pose.position, t.keys.back().pose.position);
  EXPECT_TRUE(t.at(-1, {}).velocity.isZero());
  const Pose rest{Vec3(1, 2, 3)};
  EXPECT_EQ(KeyframeTrack{}.at(5, rest).pose.position, rest.position);
  EXPECT_FALSE(KeyframeTrack{}.moves());
}

}  // namespace
}  // namespace offstage::sim
