#include "sim/articulation/joint_rows.h"

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/dynamics/free_body.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

constexpr std::array kTypes = {JointType::spherical, JointType::fixed,     JointType::revolute,
                               JointType::prismatic, JointType::universal, JointType::distance};

/// A link with constant linear acceleration and constant angular velocity.
struct Moving {
  LinkMotion start;
  Vec3 acceleration;

  LinkMotion at(Real t) const {
    LinkMotion m = start;
    m.position += t * start.velocity + t * t / 2 * acceleration;
    m.velocity += t * acceleration;
    m.axes = rotation(start.angular_velocity, t).toRotationMatrix() * start.axes;
    return m;
  }
};

Vec3 random_vector(Dice& dice) {
  return {dice.uniform(-1, 1), dice.uniform(-1, 1), dice.uniform(-1, 1)};
}

Mat3 random_axes(Dice& dice) {
  return Quat(dice.uniform(0.1, 1), dice.uniform(-1, 1), dice.uniform(-1, 1), dice.uniform(-1, 1))
      .normalized()
      .toRotationMatrix();
}

Moving random_link(Dice& dice) {
  return {{random_vector(dice), random_axes(dice), random_vector(dice), random_vector(dice)},
          random_vector(dice)};
}

JointFrame random_frame(Dice& dice) {
  return {random_vector(dice), random_axes(dice)};
}

Vec6 join(const Vec3& linear, const Vec3& angular) {
  Vec6 v;
  v << linear, angular;
  return v;
}

TEST(JointRows, AreTheDerivativesOfTheirConstraintsAnywhere) {
  Dice dice(3);
  for (int round = 0; round < 40; ++round) {
    const Moving a = random_link(dice), b = random_link(dice);
    const JointFrame on_a = random_frame(dice), on_b = random_frame(dice);
    for (const JointType type : kTypes) {
      const auto rows = [&](Real t) {
        const LinkMotion at_a = a.at(t), at_b = b.at(t);
        JointRows at_time;
        set_joint_rows({.type = type}, JointPlace(at_a, on_a, at_b, on_b), 0.5, at_time);
        return at_time;
      };
      constexpr Real kStep = 1e-4;
      const JointRows now = rows(0), before = rows(-kStep), after = rows(kStep);
      ASSERT_EQ(now.count, constraint_count({.type = type}));
      const Vec6 rate = now.on_a.transpose() * join(a.start.velocity, a.start.angular_velocity) +
                        now.on_b.transpose() * join(b.start.velocity, b.start.angular_velocity);
      const Vec6 second = now.on_a.transpose() * join(a.acceleration, Vec3::Zero()) +
                          now.on_b.transpose() * join(b.acceleration, Vec3::Zero()) + now.bias;
      EXPECT_LT(((after.error - before.error) / (2 * kStep) - rate).norm(), 1e-6) << static_cast<int>(type);
      EXPECT_LT(((after.error - 2 * now.error + before.error) / (kStep * kStep) - second).norm(), 1e-5)
          << static_cast<int>(type);
    }
  }
}

TEST(JointRows, FreeCoordinatesMoveAsTheirRowsSay) {
  Dice dice(4);
  constexpr std::array kFree = {JointType::spherical, JointType::revolute, JointType::prismatic,
                                JointType::universal, JointType::distance};
  for (int round = 0; round < 60; ++round) {
    // b moves freely. a moves relative to b as its joint allows: it turns about the joint axis, and about the
    // second axis where the joint has one.
    const Moving b = random_link(dice);
    const JointFrame frame;
    const Real angle = dice.uniform(-3, 3), lean = dice.uniform(-1.2, 1.2), rate = dice.uniform(-2, 2),
               lean_rate = dice.uniform(-2, 2);
    for (const JointType type : kFree) {
      const bool leans = type == JointType::universal || type == JointType::spherical;
      const auto coordinates = [&](Real t) {
        const LinkMotion at_b = b.at(t);
        LinkMotion at_a = at_b;
        if (type == JointType::prismatic || type == JointType::distance)
          at_a.position += at_b.axes * Vec3(0, 0, 3 + angle / 2 + t * rate);
        else
          at_a.axes = at_b.axes * Eigen::AngleAxisd(leans ? lean + t * lean_rate : 0, Vec3::UnitX()) *
                      Eigen::AngleAxisd(angle + t * rate, Vec3::UnitZ());
        const JointPlace place(at_a, frame, at_b, frame);
        return std::pair(free_row(JointDef{.type = type}, place, 1).error,
                         leans ? swing_row(type, place).error : 0);
      };
      constexpr Real kStep = 1e-5;
      const auto before = coordinates(-kStep), after = coordinates(kStep);
      const LinkMotion at_b = b.at(0);
      LinkMotion at_a = at_b;
      if (type == JointType::prismatic || type == JointType::distance) {
        const Vec3 arm = at_b.axes * Vec3(0, 0, 3 + angle / 2);
        at_a.position += arm;
        at_a.velocity += at_b.angular_velocity.cross(arm) + at_b.axes * Vec3(0, 0, rate);
      } else {
        const Mat3 leant = at_b.axes * Eigen::AngleAxisd(leans ? lean : 0, Vec3::UnitX());
        at_a.axes = leant * Eigen::AngleAxisd(angle, Vec3::UnitZ());
        at_a.angular_velocity += leant.col(2) * rate;
        if (leans) at_a.angular_velocity += at_b.axes.col(0) * lean_rate;
      }
      const JointPlace place(at_a, frame, at_b, frame);
      const auto speed = [&](const JointRow& row) {
        return row.on_a.dot(join(at_a.velocity, at_a.angular_velocity)) +
               row.on_b.dot(join(at_b.velocity, at_b.angular_velocity));
      };
      const JointRow row = free_row(JointDef{.type = type}, place, 1);
      const Real turn = 2 * std::numbers::pi;
      EXPECT_NEAR(std::remainder(after.first - before.first, turn) / (2 * kStep), speed(row), 1e-5)
          << static_cast<int>(type);
      if (!leans) continue;
      const JointRow swing = swing_row(type, place);
      EXPECT_NEAR(std::abs(swing.error), std::abs(lean), 1e-9);
      EXPECT_NEAR((after.second - before.second) / (2 * kStep), speed(swing), 1e-5) << static_cast<int>(type);
    }
  }
}

TEST(AngleOf, IsThatOfTheLibraryToRounding) {
  for (int i = -1000; i <= 1000; ++i) {
    const Real angle = i * std::numbers::pi / 1000, size = 0.1 + std::abs(i % 7);
    EXPECT_NEAR(angle_of(size * std::sin(angle), size * std::cos(angle)), angle, 2e-15);
  }
  EXPECT_EQ(angle_of(0, 0), 0);
  EXPECT_DOUBLE_EQ(angle_of(0, -1), std::numbers::pi);
}

}  // namespace
}  // namespace offstage::sim
