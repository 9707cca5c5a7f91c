/// Cloth between two bodies: the contact solver carries the load through it, so that bodies on a tablecloth
/// rest as on the table.

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kThickness = 0.005;  // of cotton [m]

/// Returns a cloth that lies 5 mm above the height `y` [m].
ClothDef tablecloth(const std::string& fabric, Real y, uint32_t cells = 16) {
  return effects::grid_cloth({1, 1, cells, cells}, {Vec3(0, y + 0.005, 0)},
                             effects::find_fabric(fabric)->fabric);
}

void add_table(World& world, bool is_plane = false) {
  if (is_plane)
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  else
    world.add_body(
        {.shape = Box{Vec3(2, 0.1, 2)}, .motion = MotionType::static_body, .pose = {Vec3(0, -0.05, 0)}});
}

/// Returns the track of a body that begins to move along x at 0.5 s.
KeyframeTrack pull(Real speed) {
  const Vec3 from(0.5, 0.01, 0);
  return {.keys = {{.time = 0, .pose = {from}},
                   {.time = 0.5, .pose = {from}},
                   {.time = 0.5 + 1.5 / speed, .pose = {from + Vec3(1.5, 0, 0)}}},
          .interpolation = Interpolation::linear};
}

/// Parameters: shape, half of its height [m], mass [kg], steps of the world per second, fabric and solver.
class BodyOnATablecloth
    : public testing::TestWithParam<std::tuple<Shape, Real, Real, Real, std::string, SolverKind>> {};

TEST_P(BodyOnATablecloth, RestsAndFallsAsleep) {
  const auto [shape, half, mass, rate, fabric, solver] = GetParam();
  World world({.max_step = 1 / rate, .solver = solver});
  add_table(world, mass > 1);
  const BodyHandle body = world.add_body({.shape = shape, .pose = {Vec3(0, half + 0.02, 0)}, .mass = mass});
  const ClothDef def = tablecloth(fabric, 0);
  world.add_cloth(def);
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  const Pose before = world.body(body).pose;
  // The cloth keeps its thickness from both bodies.
  EXPECT_NEAR(before.position.y(), half + 2 * def.thickness, 1e-4);
  EXPECT_LT(std::hypot(before.position.x(), before.position.z()), 1e-4);
  EXPECT_LT(before.vector_to_world(Vec3::UnitY()).cross(Vec3::UnitY()).norm(), 1e-3);
  EXPECT_TRUE(world.is_asleep(body));
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 60);
    ASSERT_TRUE(world.is_asleep(body)) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, BodyOnATablecloth,
    testing::Values(
        std::tuple(Shape(Sphere{0.15}), 0.15, 0.5, 240.0, "cotton", SolverKind::automatic),
        std::tuple(Shape(Sphere{0.15}), 0.15, 50.0, 60.0, "silk", SolverKind::fast),
        std::tuple(Shape(Box{Vec3(0.3, 0.3, 0.3)}), 0.15, 0.5, 60.0, "cotton", SolverKind::automatic),
        std::tuple(Shape(Box{Vec3(0.3, 0.3, 0.3)}), 0.15, 500.0, 240.0, "leather", SolverKind::exact),
        std::tuple(Shape(Box{Vec3(0.1, 0.6, 0.1)}), 0.3, 0.5, 60.0, "cotton", SolverKind::automatic),
        std::tuple(Shape(Box{Vec3(0.1, 0.6, 0.1)}), 0.3, 0.05, 60.0, "denim", SolverKind::fast),
        std::tuple(Shape(Cylinder{0.1, 0.2}), 0.1, 5.0, 240.0, "rubber", SolverKind::automatic)));

TEST(PressedCloth, LayersAddUp) {
  for (const int count : {2, 3}) {
    World world({.max_step = 1.0 / 60});
    add_table(world);
    for (int i = 0; i < count; ++i) world.add_cloth(tablecloth("cotton", 0.01 * i));
    const BodyHandle body =
        world.add_body({.shape = Box{Vec3(0.3, 0.3, 0.3)}, .pose = {Vec3(0, 0.19, 0)}, .mass = 0.5});
    for (int i = 0; i < 90; ++i) world.step(1.0 / 60);
    EXPECT_NEAR(world.body(body).pose.position.y(), 0.15 + (count + 1) * kThickness, 1e-3) << count;
    EXPECT_TRUE(world.is_asleep(body)) << count;
  }
}

TEST(PressedCloth, CarriesABodyThatIsOnlyPartlyOnIt) {
  // The border of the cloth is under the middle of the box, which leans by 10 mm in 0.3 m.
  World world({.max_step = 1.0 / 60});
  add_table(world);
  world.add_cloth(tablecloth("cotton", 0));
  const BodyHandle body =
      world.add_body({.shape = Box{Vec3(0.3, 0.3, 0.3)}, .pose = {Vec3(0.5, 0.17, 0)}, .mass = 0.5});
  for (int i = 0; i < 90; ++i) world.step(1.0 / 60);
  const Vec3 up = world.body(body).pose.vector_to_world(Vec3::UnitY());
  EXPECT_NEAR(up.x(), 2 * kThickness / 0.3, 2e-3);
  EXPECT_TRUE(world.is_asleep(body));
}

TEST(PressedCloth, KeepsTheMomentumOfTwoFreeBodies) {
  // A light box flies onto a cloth that lies on a free heavier one. Both then move on together.
  for (const Real rate : {60.0, 240.0}) {
    World world({.gravity = Vec3::Zero(), .max_step = 1 / rate, .sleep = false});
    const BodyHandle lower =
        world.add_body({.shape = Box{Vec3(0.8, 0.2, 0.8)}, .pose = {Vec3(0, -0.1, 0)}, .mass = 2});
    const BodyHandle upper = world.add_body(
        {.shape = Box{Vec3(0.3, 0.3, 0.3)}, .pose = {Vec3(0, 0.19, 0)}, .velocity = {0, -1, 0}, .mass = 0.5});
    ClothDef def = tablecloth("cotton", 0);
    def.air.density = 0;
    const ClothHandle cloth = world.add_cloth(def);
    const Real start = world.energy().total();
    for (int i = 0; i < 60; ++i) {
      world.step(1.0 / 60);
      Vec3 sum = 2 * world.body(lower).velocity + 0.5 * world.body(upper).velocity;
      for (std::size_t k = 0; k < def.masses.size(); ++k)
        sum += def.masses[k] * world.cloth(cloth).velocities[k];
      ASSERT_LE((sum - Vec3(0, -0.5, 0)).norm(), 1e-9) << i;
      ASSERT_LE(world.energy().total(), start * 1.001) << i;
    }
    const Real apart = (world.body(upper).pose.position - world.body(lower).pose.position).y();
    EXPECT_GT(apart, 0.25 + 1.8 * kThickness);
  }
}

TEST(PressedCloth, GivesFrictionToASlidingBook) {
  // It slides by v^2 / (2 mu g), with the friction between cloth and book.
  for (const Real rate : {60.0, 240.0}) {
    World world({.max_step = 1 / rate});
    add_table(world);
    const ClothDef def = tablecloth("cotton", 0);
    world.add_cloth(def);
    const BodyHandle book = world.add_body({.shape = Box{Vec3(0.2, 0.03, 0.3)},
                                            .pose = {Vec3(-0.2, 0.025, 0)},
                                            .velocity = {1, 0, 0},
                                            .mass = 0.5});
    for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
    const Real mu = std::sqrt(def.friction * 0.5), slide = 1 / (2 * mu * 9.81);
    EXPECT_NEAR(world.body(book).pose.position.x(), -0.2 + slide, 0.02 * slide) << rate;
  }
}

TEST(PressedCloth, IsPulledFromUnderABookIfItIsFast) {
  // At 5 m/s the cloth slides away under the book, which then lies on the table. At 0.3 m/s it takes the book
  // along.
  for (const Real speed : {0.3, 5.0}) {
    World world;
    add_table(world);
    BodyDef held{
        .shape = Box{Vec3(0.02, 0.02, 1)}, .motion = MotionType::kinematic, .pose = {Vec3(0.5, 0.01, 0)}};
    held.track = pull(speed);
    held.collides = false;
    const BodyHandle hand = world.add_body(held);
    const BodyHandle book =
        world.add_body({.shape = Box{Vec3(0.2, 0.03, 0.3)}, .pose = {Vec3(0, 0.026, 0)}, .mass = 0.5});
    ClothDef def = tablecloth("cotton", 0);
    for (uint32_t i = 0; i < def.vertices.size(); ++i)
      if (def.vertices[i].x() > 0.499)
        def.pins.push_back({.vertex = i, .body = hand, .position = def.vertices[i] - Vec3(0.5, 0.01, 0)});
    world.add_cloth(def);
    for (int i = 0; i < 90; ++i) world.step(1.0 / 60);
    const Vec3 at = world.body(book).pose.position;
    if (speed > 1) {
      EXPECT_LT(at.x(), 0.12);
      EXPECT_NEAR(at.y(), 0.015, 1e-3);
    } else {
      EXPECT_NEAR(at.x(), 0.3 - 0.009, 0.03);  // it slides until friction has made it as fast as the cloth
      EXPECT_NEAR(at.y(), 0.025, 1e-3);
    }
  }
}

TEST(PressedCloth, WakesTheSleeperWhenItIsGone) {
  World world;
  add_table(world);
  ClothDef def = tablecloth("cotton", 0);
  def.remove_at = 1.5;
  world.add_cloth(def);
  const BodyHandle ball = world.add_body({.shape = Sphere{0.1}, .pose = {Vec3(0, 0.12, 0)}, .mass = 1});
  for (int i = 0; i < 80; ++i) world.step(1.0 / 60);
  ASSERT_TRUE(world.is_asleep(ball));
  for (int i = 0; i < 80; ++i) world.step(1.0 / 60);
  EXPECT_NEAR(world.body(ball).pose.position.y(), 0.1, 1e-3);
}

// The cloth is pulled away so slowly that it does not wake the box, until its edge is below the middle of it.
TEST(PressedCloth, WakesTheSleeperWhenItIsPulledAway) {
  World world;
  add_table(world);
  BodyDef hand{.shape = Box{Vec3(0.02, 0.02, 1)}, .motion = MotionType::kinematic};
  for (const auto& [time, x] : {std::pair(0.0, 0.5), {1.0, 0.5}, {4.0, 0.545}, {9.0, 0.62}})
    hand.track.keys.push_back({.time = time, .pose = {Vec3(x, 0.01, 0)}});
  hand.pose = hand.track.keys.front().pose;
  hand.collides = false;
  const BodyHandle bar = world.add_body(hand);
  const BodyHandle box = world.add_body({.shape = Box{Vec3::Constant(0.04)},
                                         .pose = {Vec3(-0.46, 0.031, 0)},
                                         .mass = 0.2,
                                         .restitution = 0,
                                         .friction = 0});
  ClothDef def = tablecloth("cotton", 0);
  def.friction = 0;
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].x() > 0.499)
      def.pins.push_back({.vertex = i, .body = bar, .position = def.vertices[i] - Vec3(0.5, 0.01, 0)});
  world.add_cloth(def);
  for (int i = 0; i < 180; ++i) world.step(1.0 / 60);
  EXPECT_NEAR(world.body(box).pose.position.y(), 0.03, 1e-4);
  EXPECT_TRUE(world.is_asleep(box));
  for (int i = 0; i < 90; ++i) world.step(1.0 / 60);
  EXPECT_LT(world.body(box).pose.position.y(), 0.028);  // it leans over the edge
}

/// A box that slides on a sheet whose points are pinned: all of them on a floor, all or three of four in the
/// air.
class PinnedSheet : public testing::TestWithParam<std::tuple<int, ClothIntegrator, Real, SolverKind>> {};

TEST_P(PinnedSheet, StopsABoxByFriction) {
  const auto& [kind, integrator, step, solver] = GetParam();
  constexpr Real kSpeed = 2, kFriction = 0.5;
  World world({.max_step = step, .solver = solver});
  if (kind == 0) world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .friction = kFriction});
  constexpr uint32_t kRow = 25;
  ClothDef def = effects::grid_cloth({1.2, 0.4, kRow - 1, 8}, {Vec3(0.3, kThickness, 0)},
                                     effects::find_fabric("cotton")->fabric);
  def.air.density = 0;
  def.friction = kFriction;
  def.integrator = integrator;
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (kind != 2 || i % kRow % 2 == 0 || i / kRow % 2 == 0)
      def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  world.add_cloth(def);
  const BodyHandle box = world.add_body({.shape = Box{{0.3, 0.1, 0.3}},
                                         .pose = {Vec3(0, 2 * kThickness + 0.05, 0)},
                                         .velocity = {kSpeed, 0, 0},
                                         .mass = 1,
                                         .friction = kFriction});
  for (int i = 0; i < 0.75 / step; ++i) world.step(step);
  const Real expected = kSpeed * kSpeed / (2 * kFriction * 9.81);
  // In the air, the edges of the box meet single points, and it hops over them by a few millimetres.
  const Real tolerance = kind == 0 ? 0.005 : step > 0.01 ? 0.1 : 0.01;
  EXPECT_NEAR(world.body(box).pose.position.x(), expected, tolerance * expected);
  EXPECT_NEAR(world.body(box).pose.position.y(), 2 * kThickness + 0.05, 0.005);
}

INSTANTIATE_TEST_SUITE_P(Sheets, PinnedSheet,
                         testing::Combine(testing::Values(0, 1, 2),
                                          testing::Values(ClothIntegrator::relaxed,
                                                          ClothIntegrator::implicit),
                                          testing::Values(1.0 / 240, 1.0 / 60),
                                          testing::Values(SolverKind::exact, SolverKind::fast)));

}  // namespace
}  // namespace offstage::sim
