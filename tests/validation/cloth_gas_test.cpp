/// Gas that leaves a torn cloth.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "meshes.h"
#include "sim/cloth/cloth_state.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

TEST(ClothGas, LeavesThroughTheHolesOfATear) {
  // A closed cloth without its last triangle has one hole, of that triangle's area. At a constant volume the
  // overpressure p falls by dp/dt = -p kDischarge A sqrt(2 p / rho) / V, so 1 / sqrt(p) grows linearly.
  TriangleMesh mesh = weld(sphere_mesh(0.3, 24, 12));
  const Real closed = enclosed_volume(mesh.vertices, mesh.triangles);
  const Triangle lost = mesh.triangles[200];
  mesh.triangles.erase(mesh.triangles.begin() + 200);
  const Vec3 a = mesh.vertices[lost[0]];
  const Real area = (mesh.vertices[lost[1]] - a).cross(mesh.vertices[lost[2]] - a).norm() / 2;
  ClothGas gas;
  gas.assign(mesh.triangles);
  EXPECT_NEAR(gas.hole_area(mesh.vertices), area, 1e-9 * area);
  EXPECT_NEAR(gas.volume(mesh.vertices, mesh.triangles), closed, 1e-9 * closed);
  constexpr Real kPressure = 300, kDensity = 1.2, kTime = 5;
  for (int i = 0; i < 500; ++i) gas.leak(mesh.vertices, closed, kPressure, kDensity, kTime / 500);
  const Real flow = ClothGas::kDischarge * area * std::sqrt(2 * kPressure / kDensity);
  EXPECT_NEAR(gas.remaining_fraction(), 1 / std::pow(1 + kTime * flow / (2 * closed), 2), 1e-9);
}

TEST(ClothGas, ABalloonHitByADartTearsAndShrinks) {
  effects::Fabric rubber = effects::find_fabric("rubber")->fabric;
  rubber.areal_density = 0.3;
  rubber.damping = 0.2;
  ClothDef def = effects::mesh_cloth(sphere_mesh(0.15, 24, 16), {}, rubber);
  def.pressure = 800;
  def.tear = 1.25;
  def.self_collision = false;
  World world({.gravity = Vec3::Zero()});
  const ClothHandle cloth = world.add_cloth(def);
  const auto volume = [&] {
    const ClothView view = world.cloth(cloth);
    ClothGas gas;
    gas.assign(view.triangles);
    return gas.volume(view.points, view.triangles);
  };
  for (int i = 0; i < 24; ++i) world.step(1.0 / 48);
  const Real blown_up = volume();
  EXPECT_GT(blown_up, 1.03 * (4 * std::numbers::pi / 3 * std::pow(0.15, 3)));
  EXPECT_FALSE(world.cloth_report(cloth).first_tear.has_value());
  const BodyHandle dart = world.add_body(
      {.shape = Capsule{0.006, 0.1}, .pose = {Vec3(0, 0.4, 0)}, .velocity = {0, -15, 0}, .mass = 0.05});
  Real lowest = 0.4;
  for (int i = 0; i < 24; ++i) {
    ASSERT_TRUE(world.step(1.0 / 48).finite);
    lowest = std::min(lowest, world.body(dart).pose.position.y());
  }
  EXPECT_TRUE(world.cloth_report(cloth).first_tear.has_value());
  EXPECT_LT(lowest, 0);  // the dart went through the skin and beyond the centre
  // The gas has left the balloon, and the skin returns to its volume at rest.
  const Real rest = enclosed_volume(def.vertices, def.triangles);
  EXPECT_LT(volume() - rest, 0.5 * (blown_up - rest));
}

/// Returns a sphere with the skin of a balloon that is filled with helium.
ClothDef helium_balloon() {
  ClothDef def = effects::sphere_cloth(0.1, 2, {}, effects::find_fabric("balloon")->fabric);
  def.pressure = 8440;
  def.gas_density = 0.17;
  return def;
}

Real mass_of(const ClothDef& def) {
  return std::accumulate(def.masses.begin(), def.masses.end(), 0.0);
}

TEST(ClothGas, LiftsAWeightOnACordByArchimedes) {
  // The total momentum of the balloon, its cord and the weight grows by the external forces: the weight of
  // the displaced air minus the weights of the three.
  ClothDef def = helium_balloon();
  def.air.drag = def.air.lift = 0;
  const uint32_t last = effects::add_cord(def, {.vertex = 0, .end = {0, -0.8, 0}});
  constexpr Real kWeight = 0.006, kStep = 1.0 / 240;
  World world;
  const BodyHandle weight =
      world.add_body({.shape = Box{Vec3::Constant(0.02)}, .pose = {Vec3(0, -0.81, 0)}, .mass = kWeight});
  def.pins.push_back({.vertex = last, .body = weight, .position = Vec3(0, 0.01, 0)});
  const ClothHandle cloth = world.add_cloth(def);
  const Real total = mass_of(def) + kWeight, gravity = 9.81;
  const auto momentum = [&] {
    Real sum = kWeight * world.body(weight).velocity.y();
    for (std::size_t i = 0; i < def.masses.size(); ++i)
      sum += def.masses[i] * world.cloth(cloth).velocities[i].y();
    return sum;
  };
  Real expected = 0;
  for (int i = 0; i < 240; ++i) {
    const ClothView view = world.cloth(cloth);
    expected += kStep * gravity * ((1.2 - 0.17) * enclosed_volume(view.points, view.triangles) - total);
    world.step(kStep);
    ASSERT_TRUE(world.cloth_report(cloth).finite);
  }
  EXPECT_GT(expected, 0.01 * total);
  // A pinned point gets the last change of its body's velocity only in the next sub-step.
  EXPECT_NEAR(momentum(), expected, 2e-3 * expected);
  EXPECT_GT(world.body(weight).pose.position.y(), -0.5);
}

TEST(ClothGas, FillsABalloonInItsTime) {
  // While a balloon is inflated slowly, the virial of its springs equals that of the pressure: 3 p V = 3 p0
  // V0 t / T.
  ClothDef def = helium_balloon();
  def.gas_density.reset();
  def.inflate_time = 2;
  def.self_collision = false;
  World world({.gravity = Vec3::Zero()});
  const ClothHandle cloth = world.add_cloth(def);
  const Real filled = 3 * def.pressure * enclosed_volume(def.vertices, def.triangles);
  for (int i = 1; i <= 60; ++i) {
    world.step(1.0 / 20);
    if (i % 15 != 0) continue;
    const ClothView view = world.cloth(cloth);
    Real virial = 0;
    for (const ClothSpring& s : def.springs) {
      const Real length = (view.points[s.a] - view.points[s.b]).norm();
      virial += s.stiffness * (length - s.rest_length) * length;
    }
    const Real fraction = std::min(1.0, i / 40.0);
    EXPECT_NEAR(virial, fraction * filled, 0.02 * filled) << "after " << i / 20.0 << " s";
  }
  // A balloon that was inflated from 20 to 30 cm has the pressure of a real one.
  const ClothView view = world.cloth(cloth);
  const Real volume = enclosed_volume(view.points, view.triangles);
  EXPECT_NEAR(std::cbrt(volume * 3 / (4 * std::numbers::pi)), 0.15, 0.003);
  EXPECT_NEAR(filled / 3 / volume, 2500, 150);
}

/// Parameter: whether the cloth has self-collision.
class PoppedBalloon : public testing::TestWithParam<bool> {};

TEST_P(PoppedBalloon, FliesFreelyAndNoFasterThanItsGas) {
  // By Bernoulli's equation, gas of the gauge pressure p flows out at the speed sqrt(2 p / rho), so it cannot
  // push the remains of the skin faster. The shreds of the skin touch, but their moves are rarely shortened:
  // the median is taken, because how a skin tears depends on rounding. Of 13 speeds from 19.5 to 20.5 m/s,
  // the median has one shortened move in 120, and the greatest one in 18.
  ClothDef def = effects::sphere_cloth(0.1, 3, {}, effects::find_fabric("balloon")->fabric);
  def.pressure = 8440;
  def.gas_density = 0.17;
  def.inflate_time = 0.3;
  def.tear = 1.75;
  def.self_collision = GetParam();
  std::vector<uint64_t> limited;
  for (const Real speed : {19.6, 19.8, 20.0, 20.2, 20.4}) {
    World world({.gravity = Vec3::Zero()});
    const ClothHandle cloth = world.add_cloth(def);
    for (int i = 0; i < 30; ++i) world.step(1.0 / 60);
    ASSERT_FALSE(world.cloth_report(cloth).first_tear.has_value());
    const auto volume = [&] {
      const ClothView view = world.cloth(cloth);
      ClothGas gas;
      gas.assign(view.triangles);
      return gas.volume(view.points, view.triangles);
    };
    const Real full = volume();
    world.add_body(
        {.shape = Capsule{0.004, 0.1},
         .pose = {Vec3(-0.4, 0, 0), Quat(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitZ()))},
         .velocity = {speed, 0, 0},
         .mass = 0.02});
    limited.push_back(0);
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(world.step(1.0 / 60).finite) << i;
      limited.back() += world.cloth_report(cloth).limited;
      for (const Vec3& v : world.cloth(cloth).velocities)
        ASSERT_LT(v.norm(), std::sqrt(2 * 2500 / 0.17)) << i;
    }
    ASSERT_TRUE(world.cloth_report(cloth).first_tear.has_value());
    EXPECT_TRUE(world.cloth_report(cloth).first_tear->touches_body);
    EXPECT_LT(volume(), 0.3 * full);
  }
  std::ranges::sort(limited);
  EXPECT_LT(limited[2], 5 * def.masses.size());  // each point moves at least 320 times
}

INSTANTIATE_TEST_SUITE_P(SelfCollision, PoppedBalloon, testing::Bool());

/// Parameter: number of divisions of the sphere.
class StretchedBalloon : public testing::TestWithParam<uint32_t> {};

TEST_P(StretchedBalloon, StaysRoundAndComesToRest) {
  // p0 / lambda^3 balances 3 stretch (lambda - 1) / (lambda^2 r0) at lambda = 1.7
  // (docs/scene-guide.md). Threads that are stretched so far act across their direction nearly as much as
  // along it.
  ClothDef def = effects::sphere_cloth(0.1, GetParam(), {}, effects::find_fabric("balloon")->fabric);
  def.pressure = 13390;
  def.inflate_time = 0.7;
  World world({.gravity = Vec3::Zero()});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 36; ++i) world.step(1.0 / 24);
  const ClothView view = world.cloth(cloth);
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : view.points) centre += p / static_cast<Real>(view.points.size());
  Real fastest = 0;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    // Meshes of springs are a little softer around the twelve corners of the icosahedron.
    EXPECT_NEAR((view.points[i] - centre).norm(), 0.17, 0.03 * 0.17) << i;
    fastest = std::max(fastest, view.velocities[i].norm());
  }
  EXPECT_LT(fastest, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Balloons, StretchedBalloon, testing::Values(2, 3));

/// Parameter: longest sub-step of the world [s].
class GasInSteps : public testing::TestWithParam<Real> {};

TEST_P(GasInSteps, GivesNoEnergyToAPlateThatBouncesOnABalloon) {
  ClothDef def = effects::sphere_cloth(0.3, 2, {Vec3(0, 0.31, 0)}, effects::find_fabric("balloon")->fabric);
  def.pressure = 500;
  def.air.density = 0;
  World world({.max_step = GetParam()});
  const ClothHandle cloth = world.add_cloth(def);
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const BodyHandle plate =
      world.add_body({.shape = Box{{0.6, 0.03, 0.6}}, .pose = {Vec3(0, 0.8, 0)}, .mass = 0.3});
  world.add_joint({.name = "rail", .type = JointType::prismatic, .a = plate, .axis = Vec3::UnitY()});
  Real lowest = 0.8, highest = 0;
  for (int i = 0; i < 300; ++i) {
    world.step(1.0 / 60);
    ASSERT_TRUE(world.cloth_report(cloth).finite);
    const Real height = world.body(plate).pose.position.y();
    lowest = std::min(lowest, height);
    if (i >= 120) highest = std::max(highest, height);
  }
  EXPECT_LT(lowest, 0.66);  // it bounced
  EXPECT_NEAR(highest, 0.69, 0.015);
}

TEST_P(GasInSteps, KeepsAThinSkinUnderHighPressureStill) {
  // Waves of the length of two edges are the fastest motion of a skin under pressure.
  ClothDef def = effects::sphere_cloth(0.1, 3, {}, effects::find_fabric("balloon")->fabric);
  def.pressure = 8440;
  def.inflate_time = 0.6;
  def.pins.push_back({.vertex = 0, .position = def.vertices[0]});
  World world({.max_step = GetParam()});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 75; ++i) world.step(1.0 / 60);
  Real fastest = 0;
  for (const Vec3& v : world.cloth(cloth).velocities) fastest = std::max(fastest, v.norm());
  EXPECT_LT(fastest, 0.6);  // the balloon swings
}

INSTANTIATE_TEST_SUITE_P(Steps, GasInSteps, testing::Values(1.0 / 60, 1.0 / 240, 1.0 / 960));

/// Parameter: integrator.
class GasOnAPin : public testing::TestWithParam<ClothIntegrator> {};

TEST_P(GasOnAPin, PushesTheBodyThatHoldsTheSkin) {
  // Gas pushes a closed skin in all directions equally, so the momentum of skin and body stays zero.
  ClothDef def = effects::sphere_cloth(0.1, 2, {}, effects::find_fabric("rubber")->fabric);
  def.integrator = GetParam();
  if (def.integrator == ClothIntegrator::rk4 || def.integrator == ClothIntegrator::symplectic)
    def.substep = 0.9 * largest_stable_step(def).step;
  def.pressure = 1000;
  def.inflate_time = 0.1;
  def.air.density = 0;
  World world({.gravity = Vec3::Zero(), .max_step = 1.0 / 240});
  const BodyHandle body = world.add_body(
      {.shape = Box{Vec3::Constant(0.04)}, .pose = {Vec3(0, 0.12, 0)}, .mass = 0.05, .collides = false});
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].y() > 0.07)
      def.pins.push_back({.vertex = i, .body = body, .position = def.vertices[i] - Vec3(0, 0.12, 0)});
  ASSERT_GT(def.pins.size(), 5u);
  const ClothHandle cloth = world.add_cloth(def);
  Real greatest = 0;
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 240);
    Vec3 momentum = 0.05 * world.body(body).velocity;
    Real size = momentum.norm();
    for (std::size_t k = 0; k < def.masses.size(); ++k) {
      momentum += def.masses[k] * world.cloth(cloth).velocities[k];
      size += def.masses[k] * world.cloth(cloth).velocities[k].norm();
    }
    greatest = std::max(greatest, size);
    // `implicit` solves its equations to a tolerance.
    const Real tolerance = def.integrator == ClothIntegrator::implicit ? 5e-6 : 1e-9;
    EXPECT_LT(momentum.norm(), tolerance * std::max(greatest, 1e-3)) << i;
  }
  EXPECT_GT(greatest, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Integrators, GasOnAPin,
                         testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                         ClothIntegrator::symplectic, ClothIntegrator::rk4));

/// Parameter: number of segments of the cord.
class ClothCord : public testing::TestWithParam<uint32_t> {};

TEST_P(ClothCord, StretchesByItsStiffness) {
  // As for any elastic rod, the elongation is the fraction (load + half the weight of the cord) / stiffness
  // of the length.
  ClothDef def = effects::grid_cloth({0.2, 0.2, 2, 2}, {}, effects::find_fabric("cotton")->fabric);
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  const effects::Cord cord{
      .vertex = 4, .end = {0, -0.5, 0}, .segments = GetParam(), .stiffness = 40, .mass_per_length = 0.02};
  const uint32_t last = effects::add_cord(def, cord);
  // A body and the cloth that holds it are moved one after the other, which shifts the body by about 2 g
  // h^2.
  World world({.max_step = 1.0 / 960});
  const BodyHandle weight = world.add_body({.shape = Box{Vec3::Constant(0.02)},
                                            .pose = {Vec3(0, -0.5, 0)},
                                            .mass = 0.2,
                                            .linear_drag = 1,
                                            .collides = false});
  def.pins.push_back({.vertex = last, .body = weight, .position = Vec3::Zero()});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 240; ++i) world.step(1.0 / 60);
  const Real expected = (0.2 + 0.02 * 0.5 / 2) * 9.81 / 40 * 0.5;
  EXPECT_NEAR(-0.5 - world.body(weight).pose.position.y(), expected, 0.01 * expected);
  EXPECT_EQ(world.cloth_report(cloth).clamped, 0u);
}

INSTANTIATE_TEST_SUITE_P(Segments, ClothCord, testing::Values(1u, 12u));

TEST(ClothCord, HangsSlackAtItsLength) {
  ClothDef def = effects::grid_cloth({0.2, 0.2, 2, 2}, {}, effects::find_fabric("cotton")->fabric);
  const uint32_t first = static_cast<uint32_t>(def.vertices.size());
  for (const uint32_t segments : {8u, 9u}) {
    ClothDef with = def;
    const uint32_t last =
        effects::add_cord(with, {.vertex = 4, .end = {0.3, 0, 0}, .length = 0.5, .segments = segments});
    EXPECT_EQ(last + 1, first + segments);
    EXPECT_LT((with.vertices[last] - Vec3(0.3, 0, 0)).norm(), 1e-12);
    Real length = 0;
    for (uint32_t i = first; i <= last; ++i)
      length += (with.vertices[i] - with.vertices[i == first ? 4 : i - 1]).norm();
    EXPECT_NEAR(length, 0.5, 1e-12) << segments;
  }
}

}  // namespace
}  // namespace offstage::sim
