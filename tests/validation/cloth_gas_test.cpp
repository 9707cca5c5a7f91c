/// Gas that leaves a torn cloth.

#include <algorithm>
#include <cmath>
#include <numbers>

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
