/// Cloth pinned to bodies with joints, springs and drag. These act on the body in the sub-step in which cloth
/// pulls it, also where the cloth is heavier than the body.

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kLoadGravity = 9.81, kHolderMass = 0.2;

enum class Pins { top, all };

/// A body with a sheet of cloth below it.
struct HeldCloth {
  World world;
  BodyHandle body;
  Real mass;  // of the cloth [kg]

  HeldCloth(const WorldDef& def, Real cloth_mass, Real drag = 0) : world(def), mass(cloth_mass) {
    body = world.add_body(
        {.name = "holder", .shape = Box{{0.5, 0.02, 0.02}}, .mass = kHolderMass, .linear_drag = drag});
  }
  ClothHandle add_cloth(ClothIntegrator integrator = ClothIntegrator::relaxed, Pins pins = Pins::top,
                        BodyHandle below = {}) {
    const Pose upright{Vec3(0, -0.25, 0), Quat(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitX()))};
    ClothDef def = effects::grid_cloth({0.5, 0.5, 8, 8}, upright, effects::find_fabric("denim")->fabric);
    for (Real& m : def.masses) m = mass / static_cast<Real>(def.masses.size());
    def.air.density = 0;
    def.collides = def.self_collision = false;
    def.integrator = integrator;
    const auto pin = [&](uint32_t i, BodyHandle to) {
      def.pins.push_back(
          {.vertex = i, .body = to, .position = world.body(to).pose.point_to_body(def.vertices[i])});
    };
    for (uint32_t i = 0; i < def.vertices.size(); ++i) {
      if (pins == Pins::all || def.vertices[i].y() > -1e-6) pin(i, body);
      if (below && def.vertices[i].y() < -0.5 + 1e-6) pin(i, below);
    }
    return world.add_cloth(def);
  }
  void add_rail(const Vec3& axis) {
    world.add_joint({.name = "rail", .type = JointType::prismatic, .a = body, .axis = axis});
  }
  /// A spring along -axis whose length at rest is reached at the start.
  void add_spring(const Vec3& axis, Real stiffness, Real damping) {
    world.add_spring({.a = BodyPoint{body, Vec3::Zero()},
                      .b = WorldPoint{-axis},
                      .stiffness = stiffness,
                      .damping = damping,
                      .rest_length = 1});
  }
  void run(Real seconds) {
    for (int i = 0; i < std::lround(seconds * 60); ++i) world.step(1.0 / 60);
  }
  Vec3 place() const { return world.body(body).centre; }
  /// Mean of the place over 2 s.
  Vec3 mean_place() {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 120; ++i) {
      world.step(1.0 / 60);
      sum += place() / 120;
    }
    return sum;
  }
  Real energy() const {
    const Energy e = world.energy();
    return e.kinetic + e.potential + e.elastic;
  }
};

struct LoadCase {
  Real step, mass;
  ClothIntegrator integrator;
};
class ClothLoads : public testing::TestWithParam<LoadCase> {};

// The load acted as an impulse at the end of the sub-step. The damper resisted the motion that followed, so
// that the spring sagged by 3.3 times the right distance with the heavy cloth at 1/60 s.
TEST_P(ClothLoads, StretchADampedSpring) {
  const auto [step, mass, integrator] = GetParam();
  const Real sag = 0.05, whole = mass + kHolderMass, stiffness = whole * kLoadGravity / sag;
  for (const bool on_rail : {false, true}) {
    HeldCloth held({.max_step = step, .sleep = false}, mass);
    if (on_rail) held.add_rail(Vec3::UnitY());
    held.add_spring(-Vec3::UnitY(), stiffness, std::sqrt(stiffness * whole));
    held.add_cloth(integrator);
    held.run(6);
    EXPECT_NEAR(held.mean_place().y(), -sag, 1e-3 * sag) << "on a rail: " << on_rail;
  }
}

// The rail carries the part of the load across it.
TEST_P(ClothLoads, ActAcrossARail) {
  const auto [step, mass, integrator] = GetParam();
  const Real along = 4, sag = 0.05, whole = mass + kHolderMass, stiffness = whole * along / sag;
  HeldCloth held({.gravity = Vec3(along, -kLoadGravity, 0), .max_step = step, .sleep = false}, mass);
  held.add_rail(Vec3::UnitX());
  held.add_spring(Vec3::UnitX(), stiffness, std::sqrt(stiffness * whole));
  held.add_cloth(integrator);
  held.run(20);
  EXPECT_NEAR(held.mean_place().x(), sag, 2e-3 * sag);
}

TEST_P(ClothLoads, FallAtTheTerminalSpeed) {
  const auto [step, mass, integrator] = GetParam();
  const Real speed = 2, drag = (mass + kHolderMass) * kLoadGravity / speed;
  HeldCloth held({.max_step = step, .sleep = false}, mass, drag);
  held.add_cloth(integrator);
  held.run(6);
  const Real before = held.place().y();
  held.run(2);
  EXPECT_NEAR(before - held.place().y(), 2 * speed, 2e-3 * 2 * speed);
}

INSTANTIATE_TEST_SUITE_P(All, ClothLoads,
                         testing::Values(LoadCase{1.0 / 240, 0.1, ClothIntegrator::relaxed},
                                         LoadCase{1.0 / 240, 2, ClothIntegrator::relaxed},
                                         LoadCase{1.0 / 60, 0.1, ClothIntegrator::relaxed},
                                         LoadCase{1.0 / 60, 2, ClothIntegrator::relaxed},
                                         LoadCase{1.0 / 240, 0.5, ClothIntegrator::implicit}));

class ClothOnJoints : public testing::TestWithParam<Real> {};

// Cloth whose points are all pinned is a part of the body. Its oscillation grew by 24 700 in 10 s at 1/60 s.
TEST_P(ClothOnJoints, OscillatesOnASpring) {
  for (const Real mass : {0.06, 0.6}) {
    const Real rate = 10, whole = mass + kHolderMass, stiffness = rate * rate * whole;
    const Real amplitude = kLoadGravity / (rate * rate);
    HeldCloth held({.max_step = GetParam(), .sleep = false}, mass);
    held.add_rail(Vec3::UnitY());
    held.add_spring(-Vec3::UnitY(), stiffness, 0);
    held.add_cloth(ClothIntegrator::relaxed, Pins::all);
    Real lowest = 0, highest = -1;
    held.run(10);
    for (int i = 0; i < 60; ++i) {
      held.run(1.0 / 60);
      lowest = std::min(lowest, held.place().y());
      highest = std::max(highest, held.place().y());
    }
    EXPECT_NEAR((highest - lowest) / 2, amplitude, 0.05 * amplitude) << mass;
  }
}

// A pendulum with cloth pinned to it lost 99 % of its energy in 10 s at 1/60 s. Now it loses 2 to 4 %; the
// loss is halved with each halving of the cloth's sub-step, for any step of the world.
TEST_P(ClothOnJoints, SwingsAsAPendulum) {
  for (const Real mass : {0.06, 0.6}) {
    HeldCloth held({.max_step = GetParam(), .sleep = false}, mass);
    held.world.add_joint({.name = "pivot",
                          .type = JointType::revolute,
                          .a = held.body,
                          .anchor = Vec3(-0.25, 0, 0),
                          .axis = Vec3::UnitZ()});
    held.add_cloth(ClothIntegrator::relaxed, Pins::all);
    const Real before = held.energy(), scale = (mass + kHolderMass) * kLoadGravity * 0.25;
    held.run(10);
    EXPECT_NEAR(held.energy(), before, 0.06 * scale) << mass;
  }
}

// Cloth between two bodies that a joint connects cannot turn them.
TEST_P(ClothOnJoints, KeepsAngularMomentumBetweenJoinedBodies) {
  for (const Real mass : {0.1, 2.0}) {
    HeldCloth held({.gravity = Vec3::Zero(), .max_step = GetParam(), .sleep = false}, mass);
    const BodyHandle other = held.world.add_body(
        {.name = "other", .shape = Box{{0.5, 0.02, 0.02}}, .pose = {Vec3(0, -0.5, 0)}, .mass = kHolderMass});
    held.world.add_joint(
        {.name = "joint", .type = JointType::fixed, .a = held.body, .b = other, .anchor = Vec3(0, -0.25, 0)});
    const ClothHandle cloth = held.add_cloth(ClothIntegrator::relaxed, Pins::top, other);
    const auto spin = [&] {
      Vec3 sum = Vec3::Zero();
      for (const BodyHandle b : {held.body, other}) {
        const BodyState s = held.world.body(b);
        sum += s.angular_momentum + s.mass * s.centre.cross(s.velocity);
      }
      const ClothView view = held.world.cloth(cloth);
      for (std::size_t i = 0; i < view.points.size(); ++i)
        sum += mass / static_cast<Real>(view.points.size()) * view.points[i].cross(view.velocities[i]);
      return sum.z();
    };
    held.world.set_velocity(held.body, Vec3(-0.5, 0, 0), Vec3(0, 0, 2));
    held.world.set_velocity(other, Vec3(0.5, 0, 0), Vec3(0, 0, 2));
    held.run(0.5);
    const Real before = spin();
    held.run(5);
    EXPECT_NEAR(spin(), before, 0.01 * std::abs(before)) << mass;
  }
}

// A curtain from one bar to the next of a hinged pair, with either bar first in the list of bodies.
TEST_P(ClothOnJoints, DoesNotDependOnTheOrderOfBodies) {
  std::array<Vec3, 2> places;
  for (const bool swapped : {false, true}) {
    World world({.max_step = GetParam(), .sleep = false});
    const auto add_bar = [&](bool outer) {
      return world.add_body({.name = outer ? "outer" : "inner",
                             .shape = Box{{0.5, 0.02, 0.02}},
                             .pose = {Vec3(outer ? 0.75 : 0.25, 0, 0)},
                             .mass = outer ? 0.1 : 0.4});
    };
    const BodyHandle first = add_bar(swapped), second = add_bar(!swapped);
    const BodyHandle inner = swapped ? second : first, outer = swapped ? first : second;
    world.add_joint(
        {.name = "wall", .type = JointType::revolute, .a = inner, .axis = Vec3::UnitZ(), .damping = 0.1});
    world.add_joint({.name = "hinge",
                     .type = JointType::revolute,
                     .a = inner,
                     .b = outer,
                     .anchor = Vec3(0.5, 0, 0),
                     .axis = Vec3::UnitZ(),
                     .damping = 0.1});
    const Pose upright{Vec3(0.5, -0.25, 0),
                       Quat(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitX()))};
    ClothDef def = effects::grid_cloth({0.9, 0.5, 9, 5}, upright, effects::find_fabric("cotton")->fabric);
    def.collides = def.self_collision = false;
    for (uint32_t i = 0; i < def.vertices.size(); ++i) {
      if (def.vertices[i].y() < -1e-6) continue;
      const BodyHandle holder = def.vertices[i].x() < 0.5 ? inner : outer;
      def.pins.push_back(
          {.vertex = i, .body = holder, .position = world.body(holder).pose.point_to_body(def.vertices[i])});
    }
    world.add_cloth(def);
    for (int i = 0; i < 20; ++i) world.step(1.0 / 60);
    places[swapped] = world.body(outer).centre;
  }
  EXPECT_LT((places[0] - places[1]).norm(), 1e-4) << places[0].transpose();
  EXPECT_LT(places[0].y(), -0.1);
}

// A bar that taut cloth stops: the joint that holds it takes part, and no energy comes from it.
TEST_P(ClothOnJoints, StopsAHingedBarAtTheStretchLimit) {
  World world({.max_step = GetParam(), .sleep = false});
  const BodyHandle bar =
      world.add_body({.name = "bar", .shape = Box{{0.5, 0.02, 0.02}}, .pose = {Vec3(0.25, 0, 0)}, .mass = 2});
  world.add_joint({.name = "hinge", .type = JointType::revolute, .a = bar, .axis = Vec3::UnitZ()});
  // The sheet hangs from the world 0.4 m above the bar's end, and holds it from below.
  const Pose upright{Vec3(0.45, 0.2, 0), Quat(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitX()))};
  ClothDef def = effects::grid_cloth({0.1, 0.4, 4, 16}, upright, effects::find_fabric("cotton")->fabric);
  def.max_stretch = 1.05;
  def.collides = def.self_collision = false;
  for (uint32_t i = 0; i < def.vertices.size(); ++i) {
    if (def.vertices[i].y() > 0.4 - 1e-6) def.pins.push_back({.vertex = i, .position = def.vertices[i]});
    if (def.vertices[i].y() < 1e-6)
      def.pins.push_back(
          {.vertex = i, .body = bar, .position = world.body(bar).pose.point_to_body(def.vertices[i])});
  }
  world.add_cloth(def);
  world.set_velocity(bar, Vec3(0, -1, 0), Vec3(0, 0, -4));
  const auto energy = [&] {
    const Energy e = world.energy();
    return e.kinetic + e.potential + e.elastic;
  };
  const Real before = energy();
  for (int i = 0; i < 120; ++i) {
    world.step(1.0 / 60);
    EXPECT_LT(energy(), before + 0.02) << i;
    EXPECT_GT(world.body(bar).centre.y(), -0.03) << i;
  }
  EXPECT_LT(world.body(bar).angular_velocity.norm(), 0.5);
}

INSTANTIATE_TEST_SUITE_P(Steps, ClothOnJoints, testing::Values(1.0 / 240, 1.0 / 60));

}  // namespace
}  // namespace offstage::sim
