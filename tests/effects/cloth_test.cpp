/// Properties of cloths of the preset fabrics. Each world contains only one cloth.

#include "effects/cloth.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

/// Returns a vertical thread of n springs of stiffness k, pinned at the top.
ClothDef thread(uint32_t n, Real length, Real mass, Real stiffness, Real damping) {
  ClothDef def;
  const Real rest = length / n;
  for (uint32_t i = 0; i <= n; ++i) {
    def.vertices.push_back({0, -rest * i, 0});
    def.masses.push_back(mass / n);
    if (i > 0) def.springs.push_back({i - 1, i, rest, stiffness * n / length, damping});
  }
  def.pins.push_back({.vertex = 0, .position = Vec3::Zero()});
  def.self_collision = false;
  def.collides = false;
  def.air.density = 0;
  return def;
}

/// Returns the elongation of a hanging thread of n springs. Spring i (from the top) carries the n - i masses
/// below it.
Real hanging_elongation(uint32_t n, Real length, Real mass, Real stiffness) {
  Real sum = 0;
  for (uint32_t i = 0; i < n; ++i) sum += (n - i) * (mass / n) * 9.81 / (stiffness * n / length);
  return sum;
}

Real settled_elongation(ClothDef def, uint32_t n, Real length) {
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 96; ++i) world.step(1.0 / 24);
  return -world.cloth(cloth).points[n].y() - length;
}

/// Returns the number of connected pieces that the triangles at a point would form if the point were removed.
int fan_count(std::span<const Triangle> triangles, uint32_t point) {
  std::vector<Triangle> left;
  for (const Triangle& t : triangles)
    if (std::ranges::count(t, point) > 0) left.push_back(t);
  int fans = 0;
  while (!left.empty()) {
    ++fans;
    std::vector<Triangle> fan = {left.back()};
    left.pop_back();
    for (std::size_t k = 0; k < fan.size(); ++k)
      std::erase_if(left, [&](const Triangle& t) {
        const bool beside = std::ranges::any_of(
            t, [&](uint32_t i) { return i != point && std::ranges::count(fan[k], i) > 0; });
        if (beside) fan.push_back(t);
        return beside;
      });
  }
  return fans;
}

class EveryIntegrator : public ::testing::TestWithParam<ClothIntegrator> {};

TEST_P(EveryIntegrator, HangsAThreadByItsClosedForm) {
  for (uint32_t n : {8u, 16u}) {
    ClothDef def = thread(n, 1, 0.1, 20, 0.01 * 20 * n);
    def.integrator = GetParam();
    def.substep = 1.0 / 1920;
    EXPECT_NEAR(settled_elongation(def, n, 1) / hanging_elongation(n, 1, 0.1, 20), 1, 0.01);
  }
}

INSTANTIATE_TEST_SUITE_P(Cloth, EveryIntegrator,
                         ::testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                           ClothIntegrator::symplectic, ClothIntegrator::rk4));

TEST(Cloth, AStiffOneIsStableAtOneStepPerFrame) {
  for (ClothIntegrator integrator : {ClothIntegrator::relaxed, ClothIntegrator::implicit}) {
    ClothDef def = effects::grid_cloth({1, 1, 10, 10}, {}, effects::find_fabric("leather")->fabric);
    def.integrator = integrator;
    def.substep = 1;
    def.pins = {{.vertex = 0, .position = def.vertices[0]}, {.vertex = 10, .position = def.vertices[10]}};
    World world({.max_step = 1.0 / 24});
    const ClothHandle cloth = world.add_cloth(def);
    for (int i = 0; i < 120; ++i) {
      world.step(1.0 / 24);
      // All of the energy comes from the fall of the cloth.
      ASSERT_LE(world.energy().kinetic + world.energy().potential, 1e-9);
    }
    EXPECT_TRUE(world.cloth_report(cloth).finite);
    // Of the 4 J from its fall, the cloth keeps only a slow swing, which the air damps.
    EXPECT_LT(world.energy().kinetic, 0.1);
  }
}

TEST(Cloth, LargestStableStepIsStableAndTwiceOfItIsNot) {
  for (const auto& [factor, stable] : {std::pair{0.99, true}, {2.5, false}}) {
    ClothDef def = thread(8, 1, 0.1, 2000, 0);
    def.integrator = ClothIntegrator::symplectic;
    const StableStep limit = largest_stable_step(def);
    ASSERT_TRUE(std::isfinite(limit.step));
    def.substep = factor * limit.step;
    World world({.max_step = def.substep});
    const ClothHandle cloth = world.add_cloth(def);
    for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
    EXPECT_EQ(world.cloth_report(cloth).finite && world.cloth(cloth).points[8].norm() < 2, stable);
  }
}

TEST(Cloth, KeepsItsStretchLimitExactly) {
  ClothDef def = effects::grid_cloth({1, 1, 16, 16}, {}, effects::find_fabric("silk")->fabric);
  def.max_stretch = 1.02;
  def.max_shear = 1.05;
  def.pins = {{.vertex = 0, .position = def.vertices[0]}, {.vertex = 16, .position = def.vertices[16]}};
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 48; ++i) {
    world.step(1.0 / 24);
    const ClothView view = world.cloth(cloth);
    for (const ClothSpring& s : def.springs) {
      if (s.kind == SpringKind::bend) continue;
      const Real limit = s.kind == SpringKind::stretch ? 1.02 : 1.05;
      ASSERT_LE((view.points[s.a] - view.points[s.b]).norm() / s.rest_length, limit * (1 + 1e-9));
    }
  }
}

TEST(Cloth, RefusesErrorsByNameAndPlace) {
  ClothDef def = thread(2, 1, 1, 1, 0);
  def.springs[1].stiffness = -1;
  EXPECT_NE(problem(def).find("springs[1] stiffness"), std::string::npos);
  def = thread(2, 1, 1, 1, 0);
  def.pins[0].vertex = 9;
  EXPECT_NE(problem(def).find("pins[0]"), std::string::npos);
}

TEST(Cloth, TearsUnderALoadAndStaysAMesh) {
  ClothDef def = effects::grid_cloth({1, 1, 8, 8}, {}, effects::find_fabric("cotton")->fabric);
  def.tear = 1.1;
  for (uint32_t c = 0; c <= 8; ++c) {
    def.pins.push_back({.vertex = c, .position = def.vertices[c] - Vec3(0, 0, 0.6)});
    def.pins.push_back({.vertex = 72 + c, .position = def.vertices[72 + c] + Vec3(0, 0, 0.6)});
  }
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  uint64_t torn = 0;
  for (int i = 0; i < 12; ++i) torn += world.step(1.0 / 24).cloth.springs_torn;
  const ClothView view = world.cloth(cloth);
  EXPECT_GT(torn, 0u);
  EXPECT_GT(view.version, 0u);
  EXPECT_EQ(view.triangles.size(), def.triangles.size());
  EXPECT_EQ(view.sources.size(), view.points.size());
  for (const Triangle& t : view.triangles)
    for (uint32_t corner : t) ASSERT_LT(corner, view.points.size());
  for (uint32_t i = 0; i < view.points.size(); ++i) EXPECT_EQ(fan_count(view.triangles, i), 1) << i;
}

// A ball tears one hole. No torn pieces hang on the cloth, and single threads do not fall out of it.
TEST(Cloth, ABallTearsAHole) {
  ClothDef def = effects::grid_cloth({2, 2, 40, 40}, {Vec3(0, 1, 0)}, effects::find_fabric("cotton")->fabric);
  def.tear = 1.2;
  for (uint32_t c = 0; c <= 40; ++c) {
    def.pins.push_back({.vertex = c, .position = def.vertices[c]});
    def.pins.push_back({.vertex = 1640 + c, .position = def.vertices[1640 + c]});
  }
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  const BodyHandle ball =
      world.add_body({.shape = Sphere{0.12}, .pose = {{0.01, 1.3, 0.02}}, .velocity = {0, -12, 0}});
  uint64_t torn = 0;
  for (int i = 0; i < 12; ++i) torn += world.step(1.0 / 24).cloth.springs_torn;
  EXPECT_LT(world.body(ball).pose.position.y(), 0.5);
  EXPECT_GT(torn, 6u);
  EXPECT_LT(torn, 400u);
  const ClothView view = world.cloth(cloth);
  for (uint32_t i = 0; i < view.points.size(); ++i) EXPECT_EQ(fan_count(view.triangles, i), 1) << i;
}

// A cloth that is released while its threads are at their limit falls freely, independently of other cloths
// in the world.
TEST(Cloth, FallsFreelyAtItsStretchLimitBesideOneThatHangs) {
  const effects::Fabric cotton = effects::find_fabric("cotton")->fabric;
  World world;
  ClothHandle loose;
  for (Real x : {0.0, 5.0}) {
    ClothDef def = effects::grid_cloth({1, 1, 16, 16}, {Vec3(x, 0, 0)}, cotton);
    def.max_stretch = 1.0001;
    def.air.density = 0;
    def.pins.push_back({.vertex = 0, .position = def.vertices[0], .until = x > 0 ? 0.5 : 100});
    loose = world.add_cloth(def);
  }
  const auto mean_velocity = [&] {
    const std::vector<Real>& masses = world.cloth_def(loose).masses;
    Vec3 momentum = Vec3::Zero();
    for (std::size_t i = 0; i < masses.size(); ++i) momentum += masses[i] * world.cloth(loose).velocities[i];
    return Vec3(momentum / std::accumulate(masses.begin(), masses.end(), 0.0));
  };
  for (int i = 0; i < 30; ++i) world.step(1.0 / 60);
  const Vec3 before = mean_velocity();
  uint64_t limited = 0;
  for (int i = 0; i < 30; ++i) {
    world.step(1.0 / 60);
    limited += world.cloth_report(loose).limited;
  }
  EXPECT_GT(limited, 10000u);
  EXPECT_NEAR(mean_velocity().y() - before.y(), -9.81 * 0.5, 1e-9);
}

}  // namespace
}  // namespace offstage::sim
