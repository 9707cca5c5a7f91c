/// Bodies that hit cloth: rebounds along the axis of a symmetric cloth, and small fast bodies, which go
/// through only where the cloth tears; gas that leaves a torn cloth.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "meshes.h"
#include "sim/cloth/cloth_state.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

/// A square cloth in the plane y = 0, pinned along its border.
ClothDef framed_cloth(const effects::Fabric& fabric, Real side, uint32_t cells) {
  ClothDef def = effects::grid_cloth({side, side, cells, cells}, {}, fabric);
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (std::max(std::abs(def.vertices[i].x()), std::abs(def.vertices[i].z())) > 0.499 * side)
      def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  return def;
}

/// Fabric, cells and speed.
class ClothRebound : public testing::TestWithParam<std::tuple<std::string, uint32_t, Real>> {};

TEST_P(ClothRebound, LeavesAlongTheAxisOnWhichTheBallCame) {
  // Of a ball on the axis of a symmetric cloth, which reaches its stretch limit. What stops the ball acts on
  // one side as on the other, but for rounding and the order in which contacts and springs are solved.
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
    world.step(1.0 / 240);
    const BodyState state = world.body(ball);
    lowest = std::min(lowest, state.pose.position.y() - radius);
    ASSERT_LT(std::hypot(state.velocity.x(), state.velocity.z()), 0.05 * speed) << i;
    ASSERT_LE(state.velocity.norm(), speed * (1 + 1e-9))
        << i;  // nothing but the cloth, at rest at first, acts
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

/// Fabric, and length over rest length at which it tears.
class ClothBullet : public testing::TestWithParam<std::tuple<std::string, Real>> {};

TEST_P(ClothBullet, GoesThroughOnlyWhereTheClothTears) {
  const auto [name, tear] = GetParam();
  ClothDef def = framed_cloth(effects::find_fabric(name)->fabric, 0.6, 24);
  def.tear = tear;
  World world({.gravity = Vec3::Zero()});
  // Beside a vertex, as it usually comes: 30 g at 200 m/s.
  const BodyHandle ball = world.add_body(
      {.shape = Sphere{0.01}, .pose = {Vec3(0.009, 0.1, 0.006)}, .velocity = {0, -200, 0}, .mass = 0.03});
  const ClothHandle cloth = world.add_cloth(def);
  uint64_t torn = 0;
  for (int i = 0; i < 48; ++i) {
    ASSERT_TRUE(world.step(1.0 / 240).finite);
    torn += world.cloth_report(cloth).torn;
    ASSERT_LE(world.body(ball).velocity.norm(), 200 * (1 + 1e-9)) << i;
  }
  const bool is_through = world.body(ball).pose.position.y() < -0.5;
  EXPECT_EQ(is_through, tear > 0);
  EXPECT_EQ(torn > 0, tear > 0);
}

INSTANTIATE_TEST_SUITE_P(Fabrics, ClothBullet,
                         testing::Combine(testing::Values("cotton", "denim"), testing::Values(0.0, 1.3)));

TEST(ClothGas, LeavesThroughTheHolesOfATear) {
  // A closed cloth without its last triangle has one hole, of that triangle's area. At a constant volume the
  // overpressure p leaks at the rate kDischarge A sqrt(2 p / rho) / V of itself: 1 / sqrt(share) grows
  // linearly.
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
  EXPECT_NEAR(gas.share(), 1 / std::pow(1 + kTime * flow / (2 * closed), 2), 1e-9);
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
  for (int i = 0; i < 24; ++i) ASSERT_TRUE(world.step(1.0 / 48).finite);
  EXPECT_TRUE(world.cloth_report(cloth).first_tear.has_value());
  EXPECT_LT(world.body(dart).pose.position.y(), 0.4);
  // Its gas has left, and the skin goes back to its volume at rest.
  const Real rest = enclosed_volume(def.vertices, def.triangles);
  EXPECT_LT(volume() - rest, 0.5 * (blown_up - rest));
}

}  // namespace
}  // namespace offstage::sim
