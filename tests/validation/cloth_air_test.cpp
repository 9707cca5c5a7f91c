/// Cloth in air: decay, terminal speeds and static loads, for any step.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "meshes.h"
#include "sim/cloth/cloth_state.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kAirGravity = 9.81;

effects::Fabric light_fabric(Real areal_density) {
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.areal_density = areal_density;
  fabric.max_stretch = 0;
  return fabric;
}

Real mass_of_cloth(const ClothDef& def) {
  return std::accumulate(def.masses.begin(), def.masses.end(), 0.0);
}

Vec3 mean_velocity(const ClothDef& def, const ClothView& view) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < def.masses.size(); ++i) sum += def.masses[i] * view.velocities[i];
  return sum / mass_of_cloth(def);
}

/// Parameters: integrator, step of the world [s], whether the cloth moves along its normal (false: along
/// itself).
class ClothDecay : public testing::TestWithParam<std::tuple<ClothIntegrator, Real, bool>> {};

TEST_P(ClothDecay, SlowsDownAsUnderAQuadraticDrag) {
  // m dv/dt = -c v^2: v = v0 / (1 + c v0 t / m). At 30 m/s the air stops 0.02 kg/m^2 within 1/900 s, about a
  // sub-step. With several steps of the springs in it the error is of second order.
  const auto [integrator, step, across] = GetParam();
  ClothDef def = effects::grid_cloth({0.5, 0.5, 4, 4}, {}, light_fabric(0.02));
  def.integrator = integrator;
  def.self_collision = false;
  if (largest_stable_step(def).step < def.substep) def.substep = 0.9 * largest_stable_step(def).step;
  constexpr Real kSpeed = 30;
  const Vec3 way = across ? Vec3::UnitY() : Vec3::UnitX();
  def.velocity = kSpeed * way;
  World world({.gravity = Vec3::Zero(), .max_step = step});
  const ClothHandle cloth = world.add_cloth(def);
  const Real coefficient = across ? def.air.drag : def.air.drag - def.air.lift;
  const Real rate = 1.2 * coefficient / 2 / 0.02;
  for (int i = 1; i <= 30; ++i) {
    world.step(1.0 / 60);
    const Real expected = kSpeed / (1 + rate * kSpeed * i / 60);
    ASSERT_NEAR(mean_velocity(def, world.cloth(cloth)).dot(way), expected, 0.01 * expected) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, ClothDecay,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                                          ClothIntegrator::symplectic, ClothIntegrator::rk4),
                                          testing::Values(1.0 / 240, 1.0 / 60), testing::Bool()));

/// Parameters: integrator, step of the world [s], areal density [kg/m^2].
class ClothFall : public testing::TestWithParam<std::tuple<ClothIntegrator, Real, Real>> {};

TEST_P(ClothFall, ReachesItsTerminalSpeed) {
  // v = v_t tanh(g t / v_t) with v_t^2 = 2 sigma g / (rho C_D): 0.4 m/s and 1.6 m/s.
  const auto [integrator, step, density] = GetParam();
  ClothDef def = effects::grid_cloth({0.5, 0.5, 4, 4}, {}, light_fabric(density));
  def.integrator = integrator;
  def.self_collision = false;
  if (largest_stable_step(def).step < def.substep) def.substep = 0.9 * largest_stable_step(def).step;
  World world({.max_step = step});
  const ClothHandle cloth = world.add_cloth(def);
  const Real terminal = std::sqrt(2 * density * kAirGravity / (1.2 * def.air.drag));
  for (int i = 1; i <= 30; ++i) {
    world.step(1.0 / 60);
    const Real expected = terminal * std::tanh(kAirGravity * i / 60 / terminal);
    ASSERT_NEAR(-mean_velocity(def, world.cloth(cloth)).y(), expected, 0.002 * terminal) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, ClothFall,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                                          ClothIntegrator::symplectic, ClothIntegrator::rk4),
                                          testing::Values(1.0 / 240, 1.0 / 60), testing::Values(0.01, 0.15)));

/// Parameter: step of the world [s].
class RisingBalloon : public testing::TestWithParam<Real> {};

TEST_P(RisingBalloon, HasTheDragThatBalancesItsLift) {
  // The skin is so light that the air stops it within a step of 1/60 s. In steady motion the force of the
  // air, rho A / 2 |u| ((C_D - C_L) u + C_L (u.n) n) summed over the triangles, is the lift minus the weight.
  ClothDef def = effects::sphere_cloth(0.1, 2, {}, [] {
    effects::Fabric skin = effects::find_fabric("balloon")->fabric;
    skin.areal_density = 0.01;
    return skin;
  }());
  def.pressure = 2700;
  def.gas_density = 0.17;
  def.self_collision = false;
  World world({.max_step = GetParam()});
  const ClothHandle cloth = world.add_cloth(def);
  Real drag = 0, lift = 0;
  constexpr int kFrames = 180, kMeasured = 60;
  for (int i = 0; i < kFrames; ++i) {
    world.step(1.0 / 60);
    if (i < kFrames - kMeasured) continue;
    const ClothView view = world.cloth(cloth);
    lift += kAirGravity * ((1.2 - 0.17) * enclosed_volume(view.points, view.triangles) - mass_of_cloth(def)) /
            kMeasured;
    for (const Triangle& t : view.triangles) {
      const Vec3 doubled =
          (view.points[t[1]] - view.points[t[0]]).cross(view.points[t[2]] - view.points[t[0]]);
      const Vec3 n = doubled.normalized();
      const Vec3 u = -(view.velocities[t[0]] + view.velocities[t[1]] + view.velocities[t[2]]) / 3;
      const Vec3 force = 1.2 * doubled.norm() / 4 * u.norm() *
                         ((def.air.drag - def.air.lift) * u + def.air.lift * u.dot(n) * n);
      drag -= force.y() / kMeasured;
    }
  }
  EXPECT_NEAR(drag, lift, 0.01 * lift);
}

INSTANTIATE_TEST_SUITE_P(Steps, RisingBalloon, testing::Values(1.0 / 60, 1.0 / 240));

/// Parameters: integrator, step of the world [s].
class ClothSail : public testing::TestWithParam<std::tuple<ClothIntegrator, Real>> {};

TEST_P(ClothSail, TakesTheWholePressureOfTheWind) {
  // A light sheet is pinned along two edges to a heavy body, which gains the momentum that the air loses.
  const auto [integrator, step] = GetParam();
  constexpr Real kWind = 20, kSide = 0.5, kMass = 50;
  ClothDef def = effects::grid_cloth({kSide, kSide, 6, 6}, {}, light_fabric(0.02));
  def.air.lift = 0;  // the force is rho A / 2 |u| u, however the sheet bulges
  def.integrator = integrator;
  def.self_collision = def.collides = false;
  World world({.gravity = Vec3::Zero(), .wind = {0, kWind, 0}, .max_step = step});
  const BodyHandle body =
      world.add_body({.shape = Box{Vec3::Constant(0.5)}, .mass = kMass, .collides = false});
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (std::abs(def.vertices[i].x()) > 0.499 * kSide)
      def.pins.push_back({.vertex = i, .body = body, .position = def.vertices[i]});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  const Real before = world.body(body).velocity.y();
  Real expected = 0;
  constexpr int kSteps = 30;
  for (int i = 0; i < kSteps; ++i) {
    world.step(1.0 / 60);
    const ClothView view = world.cloth(cloth);
    for (const Triangle& t : view.triangles) {
      const Real area =
          (view.points[t[1]] - view.points[t[0]]).cross(view.points[t[2]] - view.points[t[0]]).norm() / 2;
      const Vec3 u =
          Vec3(0, kWind, 0) - (view.velocities[t[0]] + view.velocities[t[1]] + view.velocities[t[2]]) / 3;
      expected += 1.2 / 2 * area * u.norm() * u.y() / 60;
    }
  }
  EXPECT_NEAR(kMass * (world.body(body).velocity.y() - before), expected, 0.01 * expected);
}

INSTANTIATE_TEST_SUITE_P(Steps, ClothSail,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed,
                                                          ClothIntegrator::implicit),
                                          testing::Values(1.0 / 240, 1.0 / 60)));

/// Parameters: integrator, step of the world [s].
class ClothGust : public testing::TestWithParam<std::tuple<ClothIntegrator, Real>> {};

TEST_P(ClothGust, NeverMakesAFoilFasterThanItself) {
  // The air brings 2 g/m^2 to half the speed of the wind within 1/18000 s, a fraction of a sub-step.
  const auto [integrator, step] = GetParam();
  constexpr Real kWind = 60;
  ClothDef def = effects::grid_cloth({0.5, 0.5, 6, 6}, {}, [] {
    effects::Fabric fabric = light_fabric(0.002);
    fabric.stretch = 50;
    fabric.shear = 5;
    fabric.bend = 1e-8;
    return fabric;
  }());
  def.integrator = integrator;
  def.self_collision = false;
  World world({.wind = {0.6 * kWind, 0.8 * kWind, 0}, .max_step = step});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(world.step(1.0 / 60).finite);
    for (const Vec3& v : world.cloth(cloth).velocities) ASSERT_LT(v.norm(), 1.02 * kWind) << i;
  }
  EXPECT_GT(mean_velocity(def, world.cloth(cloth)).norm(), 0.95 * kWind);
}

INSTANTIATE_TEST_SUITE_P(Steps, ClothGust,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed,
                                                          ClothIntegrator::implicit),
                                          testing::Values(1.0 / 240, 1.0 / 60)));

/// A flag of 1 m x 0.7 m that a pole holds along one side, in a steady wind along it.
class Flag {
 public:
  Flag(const effects::Fabric& fabric, Real wind, Real gravity, Real step)
      : world_({.gravity = {0, -gravity, 0}, .wind = {wind, 0, 0}, .max_step = step}) {
    const Pose upright{Vec3::Zero(), Quat(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitX()))};
    ClothDef def = effects::grid_cloth({1, 0.7, kCells, kRows}, upright, fabric);
    def.self_collision = false;
    for (uint32_t i = 0; i < def.vertices.size(); ++i)
      if (def.vertices[i].x() < -0.499) def.pins.push_back({.vertex = i, .position = def.vertices[i]});
    def.rest_vertices = def.vertices;
    // A small deflection, from which the motion grows.
    for (Vec3& p : def.vertices) p.z() += 0.002 * std::sin(6 * (p.x() + 0.5));
    cloth_ = world_.add_cloth(def);
  }

  struct Swing {
    Real amplitude;  ///< amplitude of the free end, from peak to peak [m]
    Real frequency;  ///< [Hz]
  };
  /// Returns the swing during `seconds`, which follow the first `after` seconds.
  Swing swing(int seconds, int after) {
    std::vector<Real> place;
    for (int i = 0; i < 60 * (after + seconds); ++i) {
      world_.step(1.0 / 60);
      if (i >= 60 * after)
        place.push_back(world_.cloth(cloth_).points[kRows / 2 * (kCells + 1) + kCells].z());
    }
    const auto [low, high] = std::ranges::minmax(place);
    const Real middle = std::accumulate(place.begin(), place.end(), 0.0) / static_cast<Real>(place.size());
    int waves = 0;
    bool is_up = false;
    for (Real z : place) {
      const Real beyond = 0.1 * (high - low);
      waves += !is_up && z > middle + beyond;
      is_up = is_up ? z > middle - beyond : z > middle + beyond;
    }
    return {high - low, static_cast<Real>(waves) / seconds};
  }

 private:
  static constexpr uint32_t kCells = 24, kRows = 16;
  World world_;
  ClothHandle cloth_;
};

/// Parameters: wind [m/s], step of the world [s].
class FlagFlutter : public testing::TestWithParam<std::pair<Real, Real>> {};

TEST_P(FlagFlutter, HasTheStrouhalNumberOfFlappingFlags) {
  // frequency * amplitude / wind is about 0.2 for flags, as for fins and wings (Taylor, Nudds and Thomas,
  // 2003); the frequency grows with the wind.
  const auto [wind, step] = GetParam();
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.areal_density = 0.12;
  const Flag::Swing swing = Flag(fabric, wind, kAirGravity, step).swing(5, 4);
  const Real strouhal = swing.frequency * swing.amplitude / wind;
  EXPECT_GT(strouhal, 0.1);
  EXPECT_LT(strouhal, 0.3);
  EXPECT_GT(swing.amplitude, 0.1);
  EXPECT_GT(swing.frequency * 1 / wind, 0.5);  // about one wave at a time is on the flag
  EXPECT_LT(swing.frequency * 1 / wind, 1.5);
}

INSTANTIATE_TEST_SUITE_P(Winds, FlagFlutter,
                         testing::Values(std::pair(5.0, 1.0 / 240), std::pair(10.0, 1.0 / 240),
                                         std::pair(5.0, 1.0 / 60), std::pair(10.0, 1.0 / 60)));

TEST(FlagFlutter, BeginsAtACriticalWind) {
  // A stiff flag comes to rest in a slow wind, and flaps in a faster one. Bending waves as long as the flag
  // have the speed 2 pi / L sqrt(B / sigma) = 0.8 m/s. They grow if the air is so much faster than the waves
  // that they gain more energy than damping removes.
  effects::Fabric card = effects::find_fabric("cotton")->fabric;
  card.areal_density = 0.12;
  card.bend = 2e-3;
  EXPECT_LT(Flag(card, 2, 0, 1.0 / 240).swing(2, 4).amplitude, 0.005);
  const Flag::Swing slow = Flag(card, 4, 0, 1.0 / 240).swing(3, 3);
  const Flag::Swing fast = Flag(card, 8, 0, 1.0 / 240).swing(3, 3);
  EXPECT_GT(slow.amplitude, 0.1);
  EXPECT_GT(fast.amplitude, 0.1);
  EXPECT_GT(fast.frequency, 1.3 * slow.frequency);
}

/// Parameters: mass of the load [kg], step of the world [s].
class Parachute : public testing::TestWithParam<std::pair<Real, Real>> {};

TEST_P(Parachute, DescendsByItsDragArea) {
  // Half a sphere whose rim holds a load: weight = rho / 2 v^2 times the area of the mouth.
  const auto [load, step] = GetParam();
  constexpr Real kCanopyRadius = 0.5;
  TriangleMesh dome = weld(sphere_mesh(kCanopyRadius, 24, 12));
  std::erase_if(dome.triangles, [&](const Triangle& t) {
    return dome.vertices[t[0]].y() + dome.vertices[t[1]].y() + dome.vertices[t[2]].y() < 1e-9;
  });
  std::vector<uint32_t> index(dome.vertices.size(), 0);
  TriangleMesh half;
  for (std::size_t i = 0; i < index.size(); ++i) {
    index[i] = static_cast<uint32_t>(half.vertices.size());
    if (dome.vertices[i].y() > -1e-9) half.vertices.push_back(dome.vertices[i]);
  }
  for (const Triangle& t : dome.triangles) half.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
  ClothDef def = effects::mesh_cloth(half, {}, effects::find_fabric("silk")->fabric);
  def.air.drag = def.air.lift = 0;
  def.ram_pressure = 1;
  def.self_collision = def.collides = false;
  World world({.max_step = step});
  const BodyHandle body =
      world.add_body({.shape = Cylinder{kCanopyRadius, 0.02}, .mass = load, .collides = false});
  Real mouth = 0;
  for (const Triangle& t : def.triangles)
    mouth += (def.vertices[t[1]] - def.vertices[t[0]]).cross(def.vertices[t[2]] - def.vertices[t[0]]).y() / 2;
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].y() < 1e-6)
      def.pins.push_back({.vertex = i, .body = body, .position = def.vertices[i]});
  world.add_cloth(def);
  for (int i = 0; i < 180; ++i) world.step(1.0 / 60);
  const Real expected = std::sqrt(2 * (load + mass_of_cloth(def)) * kAirGravity / (1.2 * mouth));
  EXPECT_NEAR(-world.body(body).velocity.y(), expected, 0.01 * expected);
}

INSTANTIATE_TEST_SUITE_P(Loads, Parachute,
                         testing::Values(std::pair(0.3, 1.0 / 240), std::pair(0.3, 1.0 / 60),
                                         std::pair(2.0, 1.0 / 240), std::pair(2.0, 1.0 / 60)));

/// Shreds that strong wind tears off a strip turn by more than a radian in a sub-step of 1/960 s. The lift of
/// an old normal would work on their rotation: they reached 3200 m/s.
TEST(ClothShreds, AreNotMuchFasterThanTheWind) {
  constexpr Real kWind = 60;
  for (const Real step : {1.0 / 60, 1.0 / 240}) {
    World world({.wind = {0, -kWind, kWind / 100}, .max_step = step});
    const Pose upright{{0, 1, 0}, Quat(Eigen::AngleAxis<Real>(std::numbers::pi / 2, Vec3::UnitX()))};
    ClothDef def = effects::grid_cloth({0.2, 0.3, 8, 12}, upright, effects::find_fabric("cotton")->fabric);
    for (uint32_t i = 0; i < def.vertices.size(); ++i)
      if (def.vertices[i].y() > 1.15 - 1e-6) def.pins.push_back({.vertex = i, .position = def.vertices[i]});
    def.max_stretch = 0;
    def.tear = 1.05;
    def.self_collision = false;
    const ClothHandle cloth = world.add_cloth(def);
    Real fastest = 0;
    for (int i = 0; i < 30; ++i) {
      ASSERT_TRUE(world.step(1.0 / 30).finite);
      for (const Vec3& v : world.cloth(cloth).velocities) fastest = std::max(fastest, v.norm());
    }
    EXPECT_TRUE(world.cloth_report(cloth).first_tear);
    EXPECT_GT(fastest, 0.8 * kWind);
    EXPECT_LT(fastest, 1.2 * kWind);
  }
}

}  // namespace
}  // namespace offstage::sim
