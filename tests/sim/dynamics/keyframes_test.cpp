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
  for (auto kind : {Interpolation::linear, Interpolation::smooth}) {
    KeyframeTrack t = track(kind, false);
    t.spin.setZero();
    for (const Keyframe& k : t.keys) {
      const Pose p = t.at(k.time, {}).pose;
      EXPECT_NEAR((p.position - k.pose.position).norm(), 0, 1e-14);
      EXPECT_NEAR(p.orientation.angularDistance(k.pose.orientation), 0, 1e-7);
    }
  }
}

// Central differences of the pose; their error is of order d^2.
TEST(Keyframes, VelocitiesAreTheDerivativeOfThePose) {
  constexpr Real kD = 1e-5;
  for (auto kind : {Interpolation::linear, Interpolation::smooth})
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

TEST(Keyframes, SmoothVelocityIsContinuousAtKeysAndAcrossTheLoop) {
  const KeyframeTrack t = track(Interpolation::smooth, true);
  for (Real key : {0.5, 2.0, 2.7})
    EXPECT_NEAR((t.at(key - 1e-9, {}).velocity - t.at(key + 1e-9, {}).velocity).norm(), 0, 1e-6);
}

TEST(Keyframes, SmoothMotionReproducesAParabolaOverUnevenKeys) {
  KeyframeTrack t;
  const auto position = [](Real x) { return Vec3(x * x, 3 * x, 1 - 2 * x * x); };
  for (Real x : {0.0, 0.3, 1.0, 1.4, 3.0}) t.keys.push_back({x, {position(x)}});
  for (Real x : {0.35, 0.7, 1.2}) EXPECT_NEAR((t.at(x, {}).pose.position - position(x)).norm(), 0, 1e-14);
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
