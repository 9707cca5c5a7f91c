/// Bodies connected by joints, compared with closed forms and with simulations in minimal coordinates
/// (physics A1-A6, rows on articulations of the validation table).

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr Real kG = 9.81;

WorldDef quiet(Real max_step = 1.0 / 240) {
  return {.max_step = max_step, .sleep = false};
}

BodyHandle add_box(World& world, const Vec3& size, Real mass, const Vec3& position,
                   const Quat& turn = Quat::Identity(), bool collides = false) {
  BodyDef def;
  def.shape = Box{size};
  def.mass = mass;
  def.pose = {position, turn};
  def.collides = collides;
  return world.add_body(def);
}

Quat about_z(Real angle) {
  return Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ()));
}

/// Returns a rod of length 1 attached at the origin, rotated by an angle from hanging down.
BodyHandle add_pendulum(World& world, Real angle, Real width = 0.02,
                        JointDef joint = {.type = JointType::revolute}) {
  const Quat turn = about_z(angle);
  joint.a = add_box(world, {width, 1, width}, 2, turn * Vec3(0, -0.5, 0), turn);
  world.add_joint(joint);
  return joint.a;
}

Real arithmetic_geometric_mean(Real a, Real b) {
  for (int i = 0; i < 40; ++i) {
    const Real mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return a;
}

// T = 2 pi / (w0 AGM(1, cos(theta / 2))).
TEST(CompoundPendulum, HasThePeriodOfTheEllipticIntegral) {
  for (const Real degrees : {5.0, 90.0}) {
    World world(quiet());
    const BodyHandle rod = add_pendulum(world, degrees * std::numbers::pi / 180);
    const Real inertia = 1.0 / 3 + 0.02 * 0.02 / 12, w0 = std::sqrt(kG * 0.5 / inertia);
    const Real period = 2 * std::numbers::pi /
                        (w0 * arithmetic_geometric_mean(1, std::cos(degrees * std::numbers::pi / 360)));
    std::vector<Real> crossings;
    Real before = world.body(rod).centre.x();
    while (crossings.size() < 9) {
      const Real t = world.time();
      world.step(1.0 / 240);
      const Real now = world.body(rod).centre.x();
      if ((before > 0) != (now > 0)) crossings.push_back(t + before / (before - now) / 240);
      before = now;
    }
    EXPECT_NEAR((crossings[8] - crossings[0]) / 4, period, 1e-3 * period) << degrees;
  }
}

/// Returns a reference for two rods by RK4 with steps of 1e-5 s. `y`: angles from hanging down, and their
/// rates, [t1, t2, t1', t2'].
std::array<Real, 4> double_pendulum(std::array<Real, 4> y, Real time) {
  constexpr Real m = 1, l = 1, a = 0.5, width = 0.05;
  constexpr Real inertia = m * (l * l + width * width) / 12;
  const auto rate = [](const std::array<Real, 4>& s) {
    const Real difference = s[0] - s[1], c = std::cos(difference), n = std::sin(difference);
    const Real m11 = inertia + m * a * a + m * l * l, m12 = m * l * a * c, m22 = inertia + m * a * a;
    const Real f1 = -m * l * a * n * s[3] * s[3] - kG * std::sin(s[0]) * (m * a + m * l);
    const Real f2 = m * l * a * n * s[2] * s[2] - kG * m * a * std::sin(s[1]);
    const Real det = m11 * m22 - m12 * m12;
    return std::array<Real, 4>{s[2], s[3], (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det};
  };
  const auto plus = [](std::array<Real, 4> s, Real h, const std::array<Real, 4>& d) {
    for (std::size_t i = 0; i < 4; ++i) s[i] += h * d[i];
    return s;
  };
  constexpr int kSteps = 100000;
  const Real h = time / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const auto k1 = rate(y), k2 = rate(plus(y, h / 2, k1)), k3 = rate(plus(y, h / 2, k2)),
               k4 = rate(plus(y, h, k3));
    for (std::size_t k = 0; k < 4; ++k) y[k] += h / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
  }
  return y;
}

TEST(DoublePendulum, FollowsItsMinimalCoordinatesForFiveSeconds) {
  for (const JointType type : {JointType::revolute, JointType::spherical}) {
    World world(quiet());
    const Real first = 1.2, second = 0.4;
    const Vec3 elbow(std::sin(first), -std::cos(first), 0);
    const BodyHandle upper = add_box(world, {0.05, 1, 0.05}, 1, elbow / 2, about_z(first));
    const BodyHandle lower = add_box(
        world, {0.05, 1, 0.05}, 1, elbow + Vec3(std::sin(second), -std::cos(second), 0) / 2, about_z(second));
    world.add_joint({.type = type, .a = upper});
    world.add_joint({.type = type, .a = lower, .b = upper, .anchor = elbow});
    for (int i = 0; i < 5 * 240; ++i) world.step(1.0 / 240);
    const auto y = double_pendulum({first, second, 0, 0}, 5);
    const Vec3 tip = world.body(lower).pose.point_to_world({0, -0.5, 0});
    EXPECT_LT((tip - Vec3(std::sin(y[0]) + std::sin(y[1]), -std::cos(y[0]) - std::cos(y[1]), 0)).norm(),
              1e-3);
  }
}

// Steady precession with rate W of a top that is tilted by theta: I1 W^2 cos(theta) - I3 w3 W + m g l = 0.
TEST(HeavyTop, PrecessesSteadily) {
  constexpr Real kLean = std::numbers::pi / 3, kSpin = 200, radius = 0.1, height = 0.05, l = 0.1, mass = 1;
  World world(quiet());
  const Quat turn = about_z(-kLean);
  BodyDef def;
  def.shape = Cylinder{radius, height};
  def.mass = mass;
  def.collides = false;
  const Vec3 axis = turn * Vec3::UnitY();
  def.pose = {l * axis, turn};
  const Real i3 = mass * radius * radius / 2,
             i1 = mass * (3 * radius * radius + height * height) / 12 + mass * l * l;
  const Real h = i3 * kSpin, c = std::cos(kLean);
  const Real rate = (h - std::sqrt(h * h - 4 * i1 * c * mass * kG * l)) / (2 * i1 * c);
  def.angular_velocity = rate * Vec3::UnitY() + (kSpin - rate * c) * axis;
  def.velocity = def.angular_velocity.cross(def.pose.position);
  const BodyHandle top = world.add_body(def);
  world.add_joint({.a = top});
  Real turned = 0;
  Vec3 before = axis;
  for (int i = 0; i < 4 * 240; ++i) {
    world.step(1.0 / 240);
    const Vec3 now = world.body(top).pose.orientation * Vec3::UnitY();
    // Angle about +y, from +z towards +x.
    turned +=
        std::atan2(before.z() * now.x() - before.x() * now.z(), before.x() * now.x() + before.z() * now.z());
    before = now;
    ASSERT_NEAR(std::acos(now.y()), kLean, 0.01);
  }
  EXPECT_NEAR(turned, 4 * rate, 0.005 * 4 * rate);
}

struct Chain {
  std::vector<BodyHandle> links;
  std::vector<JointHandle> joints;
};

/// Returns a horizontal chain of links of half a metre that starts at the origin.
Chain add_chain(World& world, int links, JointDef joint = {}) {
  Chain chain;
  for (int i = 0; i < links; ++i) {
    chain.links.push_back(add_box(world, {0.5, 0.1, 0.1}, 1, {0.5 * i + 0.25, 0, 0}));
    joint.a = chain.links.back();
    joint.b = i > 0 ? chain.links[static_cast<std::size_t>(i) - 1] : BodyHandle{};
    joint.anchor = {0.5 * i, 0, 0};
    chain.joints.push_back(world.add_joint(joint));
  }
  return chain;
}

Real worst_gap(const World& world, const std::vector<JointHandle>& joints) {
  Real worst = 0;
  for (JointHandle j : joints) worst = std::max(worst, world.joint(j).error);
  return worst;
}

TEST(ChainReleasedLevel, KeepsItsEnergyAndItsJoints) {
  for (const auto& [links, drift] : {std::pair(10, 0.005), {100, 0.01}}) {
    World world(quiet());
    const Chain chain = add_chain(world, links);
    Real fall = 0;
    for (int i = 0; i < links; ++i) fall += kG * (0.5 * i + 0.25);
    const Real start = world.energy().total();
    for (int i = 0; i < 10 * 240; ++i) {
      world.step(1.0 / 240);
      if (i % 8 != 0) continue;
      ASSERT_LT(std::abs(world.energy().total() - start), drift * fall) << links << " after " << world.time();
      ASSERT_LT(worst_gap(world, chain.joints), 1e-9);
    }
  }
}

TEST(HangingChain, ComesToRestAsACatenary) {
  // 30 links of 0.1 m over a span of 2 m: 2 a sinh(S / 2a) = L, sag = a (cosh(S / 2a) - 1).
  constexpr int kLinks = 30;
  constexpr Real kLength = 3, kSpan = 2;
  Real low = 0.1, high = 10;
  for (int i = 0; i < 100; ++i) {
    const Real a = (low + high) / 2;
    (2 * a * std::sinh(kSpan / (2 * a)) > kLength ? low : high) = a;
  }
  const Real sag = low * (std::cosh(kSpan / (2 * low)) - 1);
  World world(quiet());
  // The chain starts as two straight parts, from the ends down to the middle.
  const Real depth = std::sqrt(kLength * kLength - kSpan * kSpan) / 2;
  std::vector<Vec3> nodes;
  for (int i = 0; i <= kLinks; ++i) {
    const Real s = 2.0 * i / kLinks;
    nodes.push_back({kSpan * s / 2, -depth * (1 - std::abs(s - 1)), 0});
  }
  BodyHandle last{};
  JointDef joint{.damping = 0.1};
  for (std::size_t i = 0; i < kLinks; ++i) {
    const Vec3 along = nodes[i + 1] - nodes[i];
    const BodyHandle link = add_box(world, {0.1, 0.01, 0.01}, 0.1, (nodes[i] + nodes[i + 1]) / 2,
                                    about_z(std::atan2(along.y(), along.x())));
    joint.a = link;
    joint.b = last;
    joint.anchor = nodes[i];
    world.add_joint(joint);
    last = link;
  }
  joint.b = {};
  joint.anchor = nodes.back();
  world.add_joint(joint);
  for (int i = 0; i < 30 * 240; ++i) world.step(1.0 / 240);
  Real lowest = 0;
  world.for_each_joint([&](JointHandle j) { lowest = std::min(lowest, world.joint(j).anchor_a.y()); });
  EXPECT_LT(world.energy().kinetic, 1e-8);
  EXPECT_NEAR(-lowest, sag, 0.005 * sag);
}

// Four revolute joints in a plane: three of their constraints are redundant.
TEST(FourBarLoop, StaysClosedForAMinute) {
  World world(quiet());
  const std::array<Vec3, 4> corners = {Vec3(0, 0, 0), Vec3(0.3, 0.8, 0), Vec3(1.4, 1.1, 0), Vec3(1.5, 0, 0)};
  std::array<BodyHandle, 3> bars;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 along = corners[i + 1] - corners[i];
    bars[i] = add_box(world, {along.norm(), 0.05, 0.05}, 1, (corners[i] + corners[i + 1]) / 2,
                      about_z(std::atan2(along.y(), along.x())));
  }
  std::vector<JointHandle> joints;
  joints.push_back(world.add_joint({.type = JointType::revolute, .a = bars[0], .anchor = corners[0]}));
  joints.push_back(
      world.add_joint({.type = JointType::revolute, .a = bars[1], .b = bars[0], .anchor = corners[1]}));
  joints.push_back(
      world.add_joint({.type = JointType::revolute, .a = bars[2], .b = bars[1], .anchor = corners[2]}));
  joints.push_back(world.add_joint({.type = JointType::revolute, .a = bars[2], .anchor = corners[3]}));
  const Real start = world.energy().total();
  for (int i = 0; i < 60 * 240; ++i) {
    const StepReport report = world.step(1.0 / 240);
    ASSERT_EQ(report.joints.unsolved, 0u);
    ASSERT_LT(worst_gap(world, joints), 1e-6) << world.time();
  }
  // The change is 2.3e-4, and a thirty-second of that at half the step: the fifth-order error of the
  // integrator over a minute.
  EXPECT_NEAR(world.energy().total(), start, 3e-4 * 3 * kG);
}

// tan(angle 2) = cos(bend) tan(angle 1), where both angles are zero if the first shaft's axle is
// perpendicular to the plane of the shafts.
TEST(UniversalJoint, TransmitsRotationByTheEquationOfHookesJoint) {
  constexpr Real kBend = 0.6;
  World world({.gravity = Vec3::Zero(), .sleep = false});
  const Vec3 second_way(std::cos(kBend), std::sin(kBend), 0);
  const BodyHandle first = add_box(world, {1, 0.1, 0.1}, 1, {-0.5, 0, 0});
  const BodyHandle second = add_box(world, {1, 0.1, 0.1}, 1, 0.5 * second_way, about_z(kBend));
  world.add_joint({.type = JointType::revolute, .a = first, .anchor = {-1, 0, 0}, .axis = Vec3::UnitX()});
  const JointHandle out =
      world.add_joint({.type = JointType::revolute, .a = second, .anchor = second_way, .axis = second_way});
  // The cross of the joint has one axle perpendicular to each shaft; at the start, the axle of the second
  // shaft is perpendicular to both.
  world.add_joint({.type = JointType::universal,
                   .a = second,
                   .b = first,
                   .axis = Vec3(-std::sin(kBend), std::cos(kBend), 0),
                   .second_axis = Vec3::UnitZ()});
  world.set_velocity(first, Vec3::Zero(), {3, 0, 0});
  for (int i = 0; i < 480; ++i) {
    world.step(1.0 / 240);
    const Quat turned = world.body(first).pose.orientation;
    const Real in = std::atan2(turned.toRotationMatrix()(2, 1), turned.toRotationMatrix()(1, 1));
    const Real angle = world.joint(out).coordinate;
    EXPECT_NEAR(std::cos(in) * std::sin(angle), std::cos(kBend) * std::sin(in) * std::cos(angle), 1e-4);
  }
}

// Slider position: x = r cos + sqrt(l^2 - r^2 sin^2).
TEST(SliderCrank, FollowsADrivenCrank) {
  constexpr Real r = 0.3, l = 1, kSpeed = 5;
  World world(quiet());
  BodyDef crank;
  crank.shape = Box{{0.6, 0.05, 0.05}};
  crank.motion = MotionType::kinematic;
  crank.track.spin = {0, 0, kSpeed};
  crank.collides = false;
  const BodyHandle wheel = world.add_body(crank);
  const BodyHandle rod = add_box(world, {l, 0.04, 0.04}, 1, {r + l / 2, 0, 0});
  const BodyHandle slider = add_box(world, {0.2, 0.2, 0.2}, 5, {r + l, 0, 0});
  world.add_joint({.type = JointType::revolute, .a = rod, .b = wheel, .anchor = {r, 0, 0}});
  world.add_joint({.type = JointType::revolute, .a = slider, .b = rod, .anchor = {r + l, 0, 0}});
  world.add_joint(
      {.type = JointType::prismatic, .a = slider, .anchor = {r + l, 0, 0}, .axis = Vec3::UnitX()});
  for (int i = 1; i <= 600; ++i) {
    world.step(1.0 / 240);
    const Real angle = kSpeed * i / 240;
    EXPECT_NEAR(world.body(slider).centre.x(),
                r * std::cos(angle) + std::sqrt(l * l - std::pow(r * std::sin(angle), 2)), 1e-6);
  }
}

class Joints : public BothSolvers {};

TEST_P(Joints, SlideDownAnInclineWithoutTurning) {
  constexpr Real kAngle = 0.5;
  World world(def());
  const BodyHandle box = add_box(world, {0.2, 0.2, 0.2}, 1, Vec3::Zero());
  const JointHandle rail = world.add_joint({.type = JointType::prismatic,
                                            .a = box,
                                            .axis = {std::cos(kAngle), -std::sin(kAngle), 0},
                                            .friction = 1});
  run(world, 1);
  // Dry friction reduces the component of the weight along the rail by 1 N.
  EXPECT_NEAR(world.joint(rail).coordinate, 0.5 * (kG * std::sin(kAngle) - 1), 1e-3);
  EXPECT_NEAR(world.body(box).angular_velocity.norm(), 0, 1e-9);
}

TEST_P(Joints, StopAtTheirLimits) {
  World world(def());
  // The rod falls from horizontal and stops 60 degrees below.
  const BodyHandle rod = add_pendulum(world, std::numbers::pi / 2, 0.02,
                                      {.type = JointType::revolute, .lower = -std::numbers::pi / 3});
  JointHandle joint;
  world.for_each_joint([&](JointHandle j) { joint = j; });
  Real lowest = 0;
  for (int i = 0; i < 480; ++i) {
    world.step(1.0 / 240);
    lowest = std::min(lowest, world.joint(joint).coordinate);
  }
  EXPECT_GT(lowest, -std::numbers::pi / 3 - 0.01);
  EXPECT_NEAR(world.joint(joint).coordinate, -std::numbers::pi / 3, 2e-4);
  EXPECT_LT(world.body(rod).angular_velocity.norm(), 1e-4);
}

TEST_P(Joints, StayWithinTheirSwingAndTwistLimits) {
  World world(def());
  JointDef neck{.axis = Vec3::UnitY(), .lower = -0.3, .upper = 0.3, .swing = 0.5, .damping = 0.05};
  neck.a = add_box(world, {0.1, 1, 0.1}, 2, {0, 0.5, 0});
  const JointHandle joint = world.add_joint(neck);
  // The body stands on its end and is given a push and a spin.
  world.set_velocity(neck.a, {0.5, 0, 0.25}, {0.5, 6, -1});
  for (int i = 0; i < 960; ++i) {
    world.step(1.0 / 240);
    ASSERT_LT(std::abs(world.joint(joint).coordinate), 0.33) << world.time();
    ASSERT_LT(std::acos(std::min(1.0, (world.body(neck.a).pose.orientation * Vec3::UnitY()).y())), 0.53);
  }
  EXPECT_NEAR(std::acos((world.body(neck.a).pose.orientation * Vec3::UnitY()).y()), 0.5, 2e-3);
  EXPECT_LT(world.body(neck.a).angular_velocity.norm(), 1e-2);
}

TEST_P(Joints, SpeedMotorsAccelerateByTheirTorqueUpToTheirSpeed) {
  World world(weightless());
  JointDef axle{.type = JointType::revolute};
  axle.motor = {.mode = Motor::Mode::speed, .targets = {{0, 10}}, .max_effort = 0.5};
  axle.a = add_box(world, {1, 1, 0.1}, 6, Vec3::Zero());  // I = m (1 + 1) / 12 = 1
  const JointHandle joint = world.add_joint(axle);
  run(world, 2);
  EXPECT_NEAR(world.joint(joint).speed, 0.5 * 2, 1e-6);
  EXPECT_NEAR(world.joint(joint).coordinate, 0.5 * 0.5 * 4, 2e-3);
  run(world, 20);
  EXPECT_NEAR(world.joint(joint).speed, 10, 1e-6);
  EXPECT_NEAR(world.joint(joint).coordinate, 10 * 22 - 0.5 * 10 * 20, 0.05);  // whole turns are counted
}

TEST_P(Joints, PositionMotorsActAsSprings) {
  // A horizontal arm of 1 m: the torque m g / 2 deflects the spring by m g l / (2 k).
  World world(def());
  JointDef arm{.type = JointType::revolute};
  arm.motor = {.mode = Motor::Mode::position, .stiffness = 500, .damping = 20};
  arm.a = add_box(world, {1, 0.05, 0.05}, 2, {0.5, 0, 0});
  const JointHandle soft = world.add_joint(arm);
  arm.motor = {.mode = Motor::Mode::position, .targets = {{0, 0}, {1, 0.5}}};
  arm.a = add_box(world, {1, 0.05, 0.05}, 2, {0.5, 0, 2});
  arm.anchor = {0, 0, 2};
  const JointHandle firm = world.add_joint(arm);
  run(world, 4);
  const Real bent = world.joint(soft).coordinate;
  EXPECT_NEAR(-500 * bent, 2 * kG * 0.5 * std::cos(bent), 1e-3 * 9.81);
  EXPECT_NEAR(world.joint(firm).coordinate, 0.5, 1e-4);
}

TEST_P(Joints, SlowDownByFrictionAndDamping) {
  World world(weightless());
  // I = 1: dry friction removes 0.3 t, viscous friction leaves a factor e^(-0.5 t).
  JointDef dry{.type = JointType::revolute, .friction = 0.3};
  dry.a = add_box(world, {1, 1, 0.1}, 6, Vec3::Zero());
  world.add_joint(dry);
  JointDef wet{.type = JointType::revolute, .anchor = {0, 0, 3}, .damping = 0.5};
  wet.a = add_box(world, {1, 1, 0.1}, 6, {0, 0, 3});
  world.add_joint(wet);
  for (BodyHandle body : {dry.a, wet.a}) world.set_velocity(body, Vec3::Zero(), {0, 0, 2});
  run(world, 4);
  EXPECT_NEAR(world.body(dry.a).angular_velocity.z(), 2 - 0.3 * 4, 1e-6);
  EXPECT_NEAR(world.body(wet.a).angular_velocity.z(), 2 * std::exp(-2.0), 2e-3);
  run(world, 4);
  EXPECT_NEAR(world.body(dry.a).angular_velocity.z(), 0, 1e-9);
}

TEST_P(Joints, BreakBeyondTheirForce) {
  World world(def());
  JointDef hook{.type = JointType::fixed, .max_force = 2.2 * kG};
  hook.a = add_box(world, {0.1, 0.1, 0.1}, 2, Vec3::Zero());
  const JointHandle joint = world.add_joint(hook);
  uint64_t broken = 0;
  for (int i = 0; i < 240; ++i) broken += world.step(1.0 / 240).joints_broken.size();
  EXPECT_EQ(broken, 0u);
  EXPECT_NEAR(world.joint(joint).force.y(), 2 * kG, 1e-6);
  // A second weight exceeds the limit.
  JointDef more{.type = JointType::fixed, .b = hook.a, .anchor = {0, -0.1, 0}};
  more.a = add_box(world, {0.1, 0.1, 0.1}, 0.5, {0, -0.1, 0});
  world.add_joint(more);
  for (int i = 0; i < 240; ++i) broken += world.step(1.0 / 240).joints_broken.size();
  EXPECT_EQ(broken, 1u);
  EXPECT_TRUE(world.joint(joint).broken);
  EXPECT_NEAR(world.body(hook.a).centre.y(), -0.5 * kG * std::pow(239.0 / 240, 2), 0.01 * kG);
  EXPECT_NEAR((world.body(hook.a).centre - world.body(more.a).centre).norm(), 0.1, 1e-9);
}

TEST_P(Joints, KeepTheLengthOfARod) {
  World world(def());
  JointDef rod{.type = JointType::distance, .anchor = {1, 0, 0}, .anchor_b = {0, 0, 0}};
  rod.a = add_box(world, {0.1, 0.1, 0.1}, 1, {1, 0, 0});
  const JointHandle joint = world.add_joint(rod);
  for (int i = 0; i < 480; ++i) {
    world.step(1.0 / 240);
    const JointState state = world.joint(joint);
    ASSERT_NEAR((state.anchor_a - state.anchor_b).norm(), 1, 1e-9);
  }
}

// A weight on a rope of 2 m starts 1 m below the anchor: it falls freely for a metre and then hangs on the
// rope.
TEST_P(Joints, RopesCanBeShorterButNotLonger) {
  World world(def());
  JointDef rope{.type = JointType::distance, .anchor_b = {0, 1, 0}, .upper = 1};
  rope.a = add_box(world, {0.1, 0.1, 0.1}, 2, Vec3::Zero());
  const JointHandle joint = world.add_joint(rope);
  const Real falls = std::sqrt(2 / kG);
  while (world.time() < falls - 0.02) world.step(1.0 / 240);
  EXPECT_NEAR(world.body(rope.a).centre.y(), -kG / 2 * std::pow(world.time(), 2), 1e-3);
  EXPECT_EQ(world.joint(joint).force.norm(), 0);
  Real lowest = 0;
  while (world.time() < 4) {
    world.step(1.0 / 240);
    lowest = std::min(lowest, world.body(rope.a).centre.y());
  }
  EXPECT_GT(lowest, -1.01);
  EXPECT_NEAR(world.body(rope.a).centre.y(), -1, 1e-3);
  EXPECT_NEAR(world.joint(joint).force.y(), 2 * kG, 1e-3 * kG);
}

TEST_P(Joints, WindTheRopeOfAWinch) {
  World world(def());
  JointDef winch{.type = JointType::distance, .anchor_b = {0, 3, 0}};
  winch.motor = {.mode = Motor::Mode::position,
                 .targets = {{0, 0}, {1, 0, Interpolation::linear}, {3, -1.5}}};
  winch.a = add_box(world, {0.1, 0.1, 0.1}, 2, Vec3::Zero());
  const JointHandle joint = world.add_joint(winch);
  run(world, 2);
  EXPECT_NEAR(world.body(winch.a).velocity.y(), 0.75, 1e-3);
  EXPECT_NEAR(world.joint(joint).force.y(), 2 * kG, 1e-3 * kG);
  run(world, 2);
  EXPECT_NEAR(world.body(winch.a).centre.y(), 1.5, 1e-3);
}

// A shelf on one fixed joint, and a box on the shelf: the force and torque of the joint are those of both
// weights.
TEST_P(Joints, ReportTheirForceAndTorque) {
  World world(def());
  JointDef wall{.type = JointType::fixed};
  wall.a = add_box(world, {1, 0.1, 0.5}, 3, {0.5, 0, 0}, Quat::Identity(), true);
  const JointHandle joint = world.add_joint(wall);
  add_box(world, {0.2, 0.2, 0.2}, 2, {0.7, 0.15, 0}, Quat::Identity(), true);
  run(world, 2);
  EXPECT_NEAR(world.joint(joint).force.y(), 5 * kG, 1e-3 * kG);
  EXPECT_NEAR(world.joint(joint).torque.z(), (3 * 0.5 + 2 * 0.7) * kG, 1e-2 * kG);
  EXPECT_LT(world.joint(joint).force.head<1>().norm() + world.joint(joint).torque.head<2>().norm(), 1e-2);
}

// The joint carries the resting ball, but breaks when the ball falls on the shelf.
TEST_P(Joints, BreakByAnImpact) {
  for (const Real height : {0.0, 1.0}) {
    World world(def());
    JointDef wall{.type = JointType::fixed, .max_force = 200};
    wall.a = add_box(world, {1, 0.1, 0.5}, 3, {0.5, 0, 0}, Quat::Identity(), true);
    world.add_joint(wall);
    BodyDef ball;
    ball.shape = Sphere{0.1};
    ball.mass = 2;
    ball.restitution = 0.5;
    ball.pose.position = {0.5, 0.15 + height, 0};
    world.add_body(ball);
    std::size_t broken = 0;
    for (int i = 0; i < 240; ++i) broken += world.step(1.0 / 240).joints_broken.size();
    EXPECT_EQ(broken, height > 0 ? 1u : 0u);
  }
}

// A ball of the greatest mass hangs on a chain of the lightest links, and falls onto the floor with it.
TEST_P(Joints, HoldAThousandTimesTheirLinksMass) {
  World world(def());
  BodyDef floor;
  floor.shape = Plane{};
  floor.motion = MotionType::static_body;
  floor.pose.position = {0, -6, 0};
  world.add_body(floor);
  std::vector<JointHandle> joints;
  BodyHandle last{};
  JointDef joint;
  for (int i = 0; i < 10; ++i) {
    joint.a = add_box(world, {0.5, 0.1, 0.1}, 1, {0.5 * i + 0.25, 0, 0}, Quat::Identity(), true);
    joint.b = last;
    joint.anchor = {0.5 * i, 0, 0};
    joints.push_back(world.add_joint(joint));
    last = joint.a;
  }
  BodyDef ball;
  ball.shape = Sphere{0.5};
  ball.mass = 1000;
  ball.pose.position = {5.5, 0, 0};
  joint.a = world.add_body(ball);
  joint.b = last;
  joint.anchor = {5, 0, 0};
  joints.push_back(world.add_joint(joint));
  Real gap = 0;
  Tally all;
  for (int i = 0; i < 5 * 240; ++i) {
    all.add(world.step(1.0 / 240));
    gap = std::max(gap, worst_gap(world, joints));
  }
  EXPECT_LT(gap, 1e-6);
  EXPECT_TRUE(all.finite);
  EXPECT_LT(all.penetration, 5e-3);
  EXPECT_GT(world.body(joint.a).centre.y(), -5.6);
}

TEST_P(Joints, TransmitTheImpulseOfACollision) {
  // A ball hits the end of the second of two hinged rods that are at rest without gravity.
  WorldDef elastic = weightless();
  World world(elastic);
  const BodyHandle first = add_box(world, {1, 0.1, 0.1}, 1, {0.5, 0, 0}, Quat::Identity(), true);
  const BodyHandle second = add_box(world, {1, 0.1, 0.1}, 1, {1.5, 0, 0}, Quat::Identity(), true);
  const JointHandle hinge =
      world.add_joint({.type = JointType::revolute, .a = second, .b = first, .anchor = {1, 0, 0}});
  BodyDef ball;
  ball.shape = Sphere{0.1};
  ball.mass = 2;
  ball.restitution = 1;
  ball.friction = 0;
  ball.pose.position = {1.9, 0.3, 0};
  ball.velocity = {0, -3, 0};
  const BodyHandle striker = world.add_body(ball);
  const Real energy = world.energy().total();
  while (world.body(striker).velocity.y() == -3 && world.time() < 1) world.step(1.0 / 240);
  const BodyState a = world.body(first), b = world.body(second), c = world.body(striker);
  EXPECT_NEAR((a.velocity + b.velocity + 2 * c.velocity).y(), -6, 1e-9);
  const auto moment = [](const BodyState& s) {
    return s.angular_momentum.z() + s.mass * s.centre.cross(s.velocity).z();
  };
  EXPECT_NEAR(moment(a) + moment(b) + moment(c), 1.9 * 2 * -3, 1e-6);
  EXPECT_NEAR(world.energy().total(), energy, is_exact() ? 1e-6 * energy : 1e-4 * energy);
  EXPECT_GT(a.velocity.norm(), 0.1);
  EXPECT_LT(world.joint(hinge).error, 1e-9);
}

TEST_P(Joints, LieStillOnTheFloorAndSleep) {
  WorldDef sleepy = def();
  sleepy.sleep = true;
  World world(sleepy);
  BodyDef floor;
  floor.shape = Plane{};
  floor.motion = MotionType::static_body;
  world.add_body(floor);
  JointDef joint{.lower = -0.5, .upper = 0.5, .swing = 0.8, .friction = 0.02};
  BodyHandle last{};
  for (int i = 0; i < 8; ++i) {
    joint.a = add_box(world, {0.2, 0.1, 0.1}, 1, {0.22 * i, 0.6 + 0.05 * i, 0}, Quat::Identity(), true);
    joint.b = last;
    joint.anchor = {0.22 * i - 0.11, 0.575 + 0.05 * i, 0};
    joint.axis = Vec3::UnitX();
    if (last) world.add_joint(joint);
    last = joint.a;
  }
  const Tally all = run(world, 5);
  EXPECT_EQ(all.last.bodies.asleep, 8u);
  EXPECT_LT(all.penetration, 1e-3);
  EXPECT_LE(all.exact_fallbacks, 2u);  // when they fall onto the floor
  EXPECT_EQ(all.fast_fallbacks + all.toi_limit_reached, 0u);
}

// Between two keys, the motor holds still for longer than bodies take to fall asleep.
TEST_P(Joints, SleepWhenTheLastKeyOfTheirMotorsIsPast) {
  WorldDef sleepy = def();
  sleepy.sleep = true;
  World world(sleepy);
  JointDef hinge{
      .type = JointType::revolute, .a = add_box(world, {1, 0.1, 0.1}, 1, {0.5, 0, 0}), .axis = Vec3::UnitZ()};
  hinge.motor = {.mode = Motor::Mode::position,
                 .targets = {{0, 0}, {3, 0}, {3.5, 0.5}},
                 .stiffness = 900,
                 .damping = 60};
  const JointHandle joint = world.add_joint(hinge);
  run(world, 2.9);
  EXPECT_FALSE(world.is_asleep(hinge.a));
  const Tally all = run(world, 4);
  EXPECT_TRUE(world.is_asleep(hinge.a));
  EXPECT_NEAR(world.joint(joint).coordinate, 0.5, 0.02);
  EXPECT_EQ(all.last.bodies.asleep, 1u);
}

TEST_P(Joints, MoveTheSameWayForAnyNumberOfThreads) {
  const auto hash = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    World world(def());
    BodyDef floor;
    floor.shape = Plane{};
    floor.motion = MotionType::static_body;
    world.add_body(floor);
    // Four chains in a heap.
    for (int chain = 0; chain < 4; ++chain) {
      JointDef joint{.swing = 1, .friction = 0.05};
      for (int i = 0; i < 6; ++i) {
        const BodyHandle last = joint.a;
        const Vec3 position(0.22 * i + 0.05 * (chain % 3), 0.3 + 0.15 * chain, 0.04 * (chain % 5));
        joint.a = add_box(world, {0.2, 0.1, 0.1}, 1, position, Quat::Identity(), true);
        joint.b = last;
        joint.axis = Vec3::UnitX();
        joint.anchor = position - Vec3(0.11, 0, 0);
        if (i > 0) world.add_joint(joint);
      }
    }
    run(world, 0.5);
    return world.state_hash();
  };
  const StateHash one = hash(1);
  EXPECT_EQ(hash(2), one);
  EXPECT_EQ(hash(2), one);
}

OFFSTAGE_BOTH_SOLVERS(Solvers, Joints);

TEST(JointDefs, InvalidDefinitionsAreRefusedWithAReason) {
  World world;
  const BodyHandle body = add_box(world, {1, 1, 1}, 1, Vec3::Zero());
  const auto message = [&](JointDef def) -> std::string {
    def.name = "hinge";
    try {
      world.add_joint(def);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(message({}).find("joint \"hinge\": at least one of its bodies must be dynamic"),
            std::string::npos);
  EXPECT_NE(message({.a = body, .b = body}).find("a and b are the same"), std::string::npos);
  EXPECT_NE(message({.a = body, .axis = Vec3::Zero()}).find("axis is 0 0 0"), std::string::npos);
  EXPECT_NE(message({.a = body, .lower = 0.1}).find("contains 0"), std::string::npos);
  EXPECT_NE(message({.a = body, .friction = -1}).find("friction is -1"), std::string::npos);
  EXPECT_NE(message({.a = body, .motor = {.mode = Motor::Mode::speed}}).find("a motor drives"),
            std::string::npos);
  EXPECT_EQ(message({.a = body}), "");
}

TEST(RemovedBodies, TakeTheirJointsWithThem) {
  World world(quiet());
  const Chain chain = add_chain(world, 3);
  world.step(1.0 / 240);
  world.remove(chain.links[1]);
  int joints = 0;
  world.for_each_joint([&](JointHandle) { ++joints; });
  EXPECT_EQ(joints, 1);
  for (int i = 0; i < 24; ++i) world.step(1.0 / 240);
  EXPECT_NEAR(world.body(chain.links[2]).velocity.y(), -kG * 25 / 240, 0.05);
}

// A door on several hinges of one axis has redundant rows, from four hinges on at a body with rows of its
// own.
TEST(RedundantJoints, HoldADoorAsOneHingeDoes) {
  for (const int hinges : {1, 3, 4, 8}) {
    World world({.sleep = false});
    const BodyHandle door = world.add_body({.shape = Box{{1, 2, 0.05}},
                                            .pose = {Vec3(0.5, 1, 0), Quat::Identity()},
                                            .velocity = {0, 0, -0.5},
                                            .angular_velocity = {0, 1, 0},
                                            .mass = 20});
    for (int i = 0; i < hinges; ++i)
      world.add_joint({.type = JointType::revolute,
                       .a = door,
                       .anchor = {0, 0.2 + 1.6 * i / hinges, 0},
                       .axis = Vec3::UnitY()});
    uint64_t unsolved = 0;
    for (int i = 0; i < 60; ++i) unsolved += world.step(1.0 / 60).joints.unsolved;
    EXPECT_EQ(unsolved, 0u) << hinges;
    EXPECT_NEAR(world.body(door).pose.position.y(), 1, 1e-6) << hinges;
    EXPECT_NEAR(world.body(door).angular_velocity.y(), 1, 1e-6) << hinges;
  }
}

TEST(RedundantJoints, WeldTwoBoxesByManyJoints) {
  World world({.gravity = Vec3::Zero(), .sleep = false});
  const BodyHandle a = world.add_body({.shape = Box{{1, 1, 1}}, .angular_velocity = {0, 0.3, 1}, .mass = 2});
  const BodyHandle b = world.add_body({.shape = Box{{1, 1, 1}},
                                       .pose = {Vec3(1.2, 0, 0), Quat::Identity()},
                                       .velocity = Vec3(0, 0.3, 1).cross(Vec3(1.2, 0, 0)),
                                       .angular_velocity = {0, 0.3, 1},
                                       .mass = 2});
  for (int i = 0; i < 5; ++i)
    world.add_joint({.type = JointType::fixed, .a = a, .b = b, .anchor = {0.6, 0.1 * i, 0}});
  const Real before = world.energy().kinetic;
  uint64_t unsolved = 0;
  for (int i = 0; i < 60; ++i) unsolved += world.step(1.0 / 60).joints.unsolved;
  EXPECT_EQ(unsolved, 0u);
  EXPECT_NEAR(world.energy().kinetic / before, 1, 1e-4);
  const Pose pa = world.body(a).pose, pb = world.body(b).pose;
  EXPECT_NEAR((pa.point_to_body(pb.position) - Vec3(1.2, 0, 0)).norm(), 0, 1e-5);
}

}  // namespace
}  // namespace offstage::sim
