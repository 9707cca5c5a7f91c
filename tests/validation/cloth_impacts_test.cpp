/// Bodies that hit cloth: rebounds along the axis of a symmetric cloth, and small fast bodies, which go
/// through only where the cloth tears.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

/// Returns a square cloth in the plane y = 0, pinned along its border.
ClothDef framed_cloth(const effects::Fabric& fabric, Real side, uint32_t cells) {
  ClothDef def = effects::grid_cloth({side, side, cells, cells}, {}, fabric);
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (std::max(std::abs(def.vertices[i].x()), std::abs(def.vertices[i].z())) > 0.499 * side)
      def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  return def;
}

/// Parameters: fabric, number of cells, speed of the ball [m/s].
class ClothRebound : public testing::TestWithParam<std::tuple<std::string, uint32_t, Real>> {};

TEST_P(ClothRebound, LeavesAlongTheAxisOnWhichTheBallCame) {
  // A ball hits a symmetric cloth on its axis, and the cloth reaches its stretch limit. The forces on the
  // ball are symmetric, except for rounding and the order in which contacts and springs are solved.
  const auto [name, cells, speed] = GetParam();
  const bool is_denim = name == "denim";
  const Real radius = is_denim ? 0.1 : 0.16, mass = is_denim ? 1 : 3.1;
  effects::Fabric fabric = effects::find_fabric(name)->fabric;
  if (!is_denim) fabric.thickness = 0.012;
  World world({.gravity = Vec3::Zero()});
  const BodyHandle ball = world.add_body({.shape = Sphere{radius},
                                          .pose = {Vec3(0, radius + 0.05, 0)},
                                          .velocity = {0, -speed, 0},
                                          .mass = mass});
  world.add_cloth(framed_cloth(fabric, 1.2, cells));
  Real lowest = 0;
  for (int i = 0; i < 180; ++i) {
    const StepReport report = world.step(1.0 / 240);
    const BodyState state = world.body(ball);
    lowest = std::min(lowest, state.pose.position.y() - radius);
    ASSERT_LT(report.cloth.penetration, fabric.thickness) << i;
    ASSERT_LT(std::hypot(state.velocity.x(), state.velocity.z()), 0.05 * speed) << i;
    // Only the cloth acts on the ball, and the cloth is at rest at first.
    ASSERT_LE(state.velocity.norm(), speed * (1 + 1e-9)) << i;
  }
  // The cloth gave way nearly as far as its limit lets it, 0.6 sqrt(1.1^2 - 1) = 0.275 m, and threw the ball
  // back.
  EXPECT_LT(lowest, -0.15);
  EXPECT_GT(lowest, -0.28);
  EXPECT_GT(world.body(ball).velocity.y(), 0.05 * speed);
}

INSTANTIATE_TEST_SUITE_P(Balls, ClothRebound,
                         testing::Combine(testing::Values("cotton", "denim"), testing::Values(24, 40),
                                          testing::Values(5.5, 12.0)));

/// Parameters: fabric, length over rest length at which the cloth tears, position of the impact [m].
class ClothBullet : public testing::TestWithParam<std::tuple<std::string, Real, Real>> {};

TEST_P(ClothBullet, GoesThroughOnlyWhereTheClothTears) {
  // A ball of 30 g and 200 m/s that is smaller than a cell, on a vertex, beside one and on an edge.
  const auto [name, tear, place] = GetParam();
  ClothDef def = framed_cloth(effects::find_fabric(name)->fabric, 0.6, 24);
  def.tear = tear;
  World world({.gravity = Vec3::Zero()});
  const BodyHandle ball = world.add_body({.shape = Sphere{0.01},
                                          .pose = {Vec3(place, 0.1, 0.67 * place)},
                                          .velocity = {0, -200, 0},
                                          .mass = 0.03});
  const ClothHandle cloth = world.add_cloth(def);
  uint64_t torn = 0;
  for (int i = 0; i < 48; ++i) {
    ASSERT_TRUE(world.step(1.0 / 240).finite);
    torn += world.cloth_report(cloth).torn;
    ASSERT_LE(world.body(ball).velocity.norm(), 200 * (1 + 1e-9)) << i;
  }
  EXPECT_EQ(torn > 0, tear > 0);
  // Tearing adds points, whose masses are taken from their neighbours.
  const ClothView view = world.cloth(cloth);
  ASSERT_EQ(view.masses.size(), view.points.size());
  EXPECT_NEAR(std::accumulate(view.masses.begin(), view.masses.end(), 0.0),
              std::accumulate(def.masses.begin(), def.masses.end(), 0.0), 1e-12);
  if (tear > 0) return;
  // A whole cloth gives way by half its width times sqrt(1.1^2 - 1) = 0.14 m, and throws the ball back.
  EXPECT_GT(world.body(ball).pose.position.y(), -0.15);
  EXPECT_GT(world.body(ball).velocity.y(), 0);
}

INSTANTIATE_TEST_SUITE_P(Fabrics, ClothBullet,
                         testing::Combine(testing::Values("cotton", "denim"), testing::Values(0.0, 1.3),
                                          testing::Values(0.0, 0.009, 0.0125)));

/// Parameters: fabric, shape, mass [kg], speed of the body [m/s], steps of the world per second, and height
/// of the cloth above the ground [m].
class ClothAboveGround
    : public testing::TestWithParam<std::tuple<std::string, Shape, Real, Real, Real, Real>> {};

TEST_P(ClothAboveGround, StopsABodyThatWouldReachTheGroundInTheSameSubStep) {
  // If the body first collided with the ground, it would end under the cloth, or the cloth would throw it
  // back with the speed of its rebound in addition.
  const auto [name, shape, mass, speed, rate, height] = GetParam();
  World world({.max_step = 1 / rate, .sleep = false});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0.5});
  const Vec3 from(0.013, height + 0.3, 0.017);
  const BodyHandle body = world.add_body(
      {.shape = shape, .pose = {from}, .velocity = {0, -speed, 0}, .mass = mass, .restitution = 0.5});
  ClothDef def = framed_cloth(effects::find_fabric(name)->fabric, 1.2, 24);
  for (Vec3& p : def.vertices) p.y() += height;
  for (ClothPin& pin : def.pins) pin.position.y() += height;
  world.add_cloth(def);
  const Real start = speed * speed / 2;
  for (int i = 0; i < 15; ++i) {
    ASSERT_TRUE(world.step(1.0 / 60).finite);
    const BodyState state = world.body(body);
    // The cloth gives way by at most 0.6 sqrt(1.1^2 - 1) = 0.275 m.
    ASSERT_GT(state.pose.position.y(), height - 0.28) << i;
    ASSERT_LE(state.velocity.squaredNorm() / 2 + 9.81 * (state.pose.position - from).y(), start * 1.001) << i;
  }
  // After 0.25 s it has been thrown back, or lies in the cloth.
  EXPECT_GT(world.body(body).pose.position.y(), height - 0.05);
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, ClothAboveGround,
    testing::Values(std::tuple("cotton", Shape(Sphere{0.1}), 1.0, 60.0, 60.0, 0.7),
                    std::tuple("cotton", Shape(Sphere{0.1}), 1.0, 60.0, 60.0, 0.8),
                    std::tuple("cotton", Shape(Sphere{0.1}), 1.0, 180.0, 240.0, 0.5),
                    std::tuple("leather", Shape(Sphere{0.02}), 0.1, 60.0, 60.0, 0.7),
                    std::tuple("denim", Shape(Sphere{0.02}), 0.1, 60.0, 60.0, 0.7),
                    std::tuple("silk", Shape(Box{Vec3(0.15, 0.15, 0.15)}), 1.0, 100.0, 60.0, 0.5),
                    std::tuple("denim", Shape(Cone{0.1, 0.2}), 1.0, 60.0, 60.0, 0.5),
                    std::tuple("leather", Shape(Capsule{0.02, 0.3}), 1.0, 200.0, 240.0, 0.5)));

TEST(ClothImpacts, GiveAFreeClothNoEnergyOfTheirOwn) {
  // The cloth is forty times lighter than the ball that hits it, and soon reaches its stretch limit.
  ClothDef def = effects::grid_cloth({0.4, 0.4, 8, 8}, {}, effects::find_fabric("cotton")->fabric);
  def.air.density = 0;
  World world({.gravity = Vec3::Zero(), .max_step = 1.0 / 120});
  world.add_body({.shape = Sphere{0.1}, .pose = {Vec3(0.1, 0.12, 0)}, .velocity = {0, -12, 0}, .mass = 1});
  const ClothHandle cloth = world.add_cloth(def);
  const Real before = world.energy().total();
  uint64_t contacts = 0;
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 120);
    contacts += world.cloth_report(cloth).contacts;
    ASSERT_LE(world.energy().total(), before * (1 + 1e-9)) << i;
  }
  EXPECT_GT(contacts, 0);
}

/// Parameters: integrator, steps of the world per second, mass of the ball [kg].
class ClothHit : public testing::TestWithParam<std::tuple<ClothIntegrator, Real, Real>> {};

TEST_P(ClothHit, GivesBallAndFreeClothNoEnergyAndKeepsTheirMomentum) {
  // The ball is up to thirty times faster than a wave of bending. The cloth reaches its stretch limit, folds
  // around the ball and touches itself, so that moves are shortened. Corrections of overlaps may store up to
  // 0.3 % of the energy for a few sub-steps.
  const auto [integrator, rate, mass] = GetParam();
  uint64_t limited = 0;
  for (const Real speed : {12.0, 30.0, 60.0})
    for (const Real offset : {0.0, 0.05, 0.1}) {
      ClothDef def = effects::grid_cloth({0.4, 0.4, 8, 8}, {}, effects::find_fabric("cotton")->fabric);
      def.air.density = 0;
      def.integrator = integrator;
      def.substep = std::min(def.substep, 0.9 * largest_stable_step(def).step);
      World world({.gravity = Vec3::Zero(), .max_step = 1 / rate});
      const BodyHandle ball = world.add_body(
          {.shape = Sphere{0.1}, .pose = {Vec3(offset, 0.12, 0)}, .velocity = {0, -speed, 0}, .mass = mass});
      const ClothHandle cloth = world.add_cloth(def);
      const Real before = world.energy().total();
      for (int i = 0; i < 30; ++i) {
        world.step(1.0 / 120);
        const ClothView view = world.cloth(cloth);
        limited += world.cloth_report(cloth).limited;
        ASSERT_LE(world.energy().total(), 1.003 * before) << speed << " m/s, " << offset << " m, step " << i;
        Vec3 momentum = mass * world.body(ball).velocity + Vec3(0, speed * mass, 0);
        for (std::size_t k = 0; k < view.points.size(); ++k) momentum += def.masses[k] * view.velocities[k];
        ASSERT_LE(momentum.norm(), 1e-9 * mass * speed) << speed << " m/s, " << offset << " m, step " << i;
      }
      EXPECT_LT(world.body(ball).velocity.norm(), speed);
    }
  EXPECT_GT(limited, 0);
}

INSTANTIATE_TEST_SUITE_P(Integrators, ClothHit,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                                          ClothIntegrator::symplectic, ClothIntegrator::rk4),
                                          testing::Values(60, 240), testing::Values(0.05, 1, 10)));

/// Integrator, longest step of the world and inclination of the sheet [rad].
class ClothLanding : public testing::TestWithParam<std::tuple<ClothIntegrator, Real, Real>> {};

TEST_P(ClothLanding, TakesEnergy) {
  // A sheet that falls on its edge. Its springs are so stiff that they would store many times the energy of
  // the motion if the lowest points moved on in a sub-step and were put back onto the floor after it.
  const auto [integrator, rate, inclination] = GetParam();
  const Pose upright{Vec3(0, 1, 0),
                     Quat(Eigen::AngleAxisd(std::numbers::pi / 2 - inclination, Vec3::UnitX()))};
  ClothDef def = effects::grid_cloth({1, 1, 20, 20}, upright, effects::find_fabric("cotton")->fabric);
  def.air.density = 0;
  def.self_collision = false;
  def.integrator = integrator;
  def.substep = std::min(def.substep, 0.9 * largest_stable_step(def).step);
  World world({.max_step = 1 / rate});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const ClothHandle cloth = world.add_cloth(def);
  const Real start = world.energy().total();
  Real lowest = start;
  uint64_t contacts = 0;
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 60);
    contacts += world.cloth_report(cloth).contacts;
    const Real energy = world.energy().total();
    ASSERT_LE(energy, lowest + 1e-3 * start) << i;
    lowest = std::min(lowest, energy);
  }
  EXPECT_GT(contacts, 0u);
}

INSTANTIATE_TEST_SUITE_P(Sheets, ClothLanding,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                                          ClothIntegrator::symplectic, ClothIntegrator::rk4),
                                          testing::Values(60, 240), testing::Values(0.0, 0.1)));

/// Integrator, mass of the box [kg] and fabric.
class ClothLandingOnABody : public testing::TestWithParam<std::tuple<ClothIntegrator, Real, std::string>> {
 protected:
  /// Returns an upright sheet above the box that falls at 3 m/s.
  static ClothDef sheet() {
    const Pose upright{Vec3(0, 1, 0), Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()))};
    const effects::Fabric fabric = effects::find_fabric(std::get<2>(GetParam()))->fabric;
    ClothDef def = effects::grid_cloth({1, 1, 20, 20}, upright, fabric);
    def.air.density = 0;
    def.self_collision = false;
    def.integrator = std::get<0>(GetParam());
    def.velocity = Vec3(0, -3, 0);
    return def;
  }
  static BodyHandle add_box(World& world) {
    return world.add_body(
        {.shape = Box{Vec3(1.5, 0.2, 1.5)}, .pose = {Vec3(0, 0.1, 0)}, .mass = std::get<1>(GetParam())});
  }
};

TEST_P(ClothLandingOnABody, TakesEnergyAndKeepsMomentum) {
  // A sheet is thrown onto a free box, edge first. If its lowest points moved on in a sub-step and were put
  // back onto the box after it, its springs would store up to three times the energy of the motion. If a
  // light box did not move within the sub-step, it would get too large an impulse.
  const Real mass = std::get<1>(GetParam());
  const ClothDef def = sheet();
  World world({.gravity = Vec3::Zero(), .max_step = 1.0 / 60, .sleep = false});
  const BodyHandle box = add_box(world);
  const ClothHandle cloth = world.add_cloth(def);
  const auto momentum = [&] {
    Vec3 sum = mass * world.body(box).velocity;
    for (std::size_t k = 0; k < def.masses.size(); ++k)
      sum += def.masses[k] * world.cloth(cloth).velocities[k];
    return sum;
  };
  const Real start = world.energy().total();
  const Vec3 whole = momentum();
  Real lowest = start;
  uint64_t contacts = 0;
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 60);
    contacts += world.cloth_report(cloth).contacts;
    ASSERT_LE(world.energy().total(), lowest + 1e-3 * start) << i;
    ASSERT_LE((momentum() - whole).norm(), 1e-9 * whole.norm()) << i;
    lowest = std::min(lowest, world.energy().total());
  }
  EXPECT_GT(contacts, 0u);
}

TEST_P(ClothLandingOnABody, GainsNothingOnTheGround) {
  World world({.max_step = 1.0 / 60, .sleep = false});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  add_box(world);
  const ClothHandle cloth = world.add_cloth(sheet());
  const Real start = world.energy().total();
  uint64_t contacts = 0;
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 60);
    contacts += world.cloth_report(cloth).contacts;
    ASSERT_LE(world.energy().total(), 1.001 * start) << i;
  }
  EXPECT_GT(contacts, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Boxes, ClothLandingOnABody,
    testing::Combine(testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit),
                     testing::Values(0.03, 0.3, 3, 100), testing::Values("silk", "cotton", "leather")));

}  // namespace
}  // namespace offstage::sim
