/// Cloth that slides on cloth: without friction it keeps its speed, and with friction it slows down as
/// Coulomb's law says. Neither depends on the cells and the thickness of the layers.

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kGravity = 9.81;

struct Sliding {
  std::string name;
  ClothIntegrator integrator;
  Real step;          // of the world [s]
  Real thickness;     // [m]
  Real lower, upper;  // sizes of the cells [m]
  Real turn;          // angle between the grids [deg]
};

class ClothOnCloth : public testing::TestWithParam<Sliding> {
 protected:
  /// Returns a sheet in the plane y = 0, without air.
  static ClothDef sheet(Real length, Real width, Real cell, Real friction) {
    const auto count = [&](Real size) { return static_cast<uint32_t>(std::lround(size / cell)); };
    effects::Fabric fabric;
    fabric.thickness = GetParam().thickness;
    ClothDef def = effects::grid_cloth({length, width, count(length), count(width)}, {}, fabric);
    def.integrator = GetParam().integrator;
    def.self_friction = friction;
    def.air.density = 0;
    return def;
  }
  /// Lets a sheet of 0.4 m slide with the velocity `speed` [m/s] on a pinned sheet, down a slope [rad].
  /// Afterwards, moved_ and velocity_ are those of its centre along the x axis.
  void slide(Real speed, Real friction, Real slope, Real duration) {
    World world({.gravity = kGravity * Vec3(std::sin(slope), -std::cos(slope), 0)});
    ClothDef lower = sheet(2.4, 0.6, GetParam().lower, friction);
    for (uint32_t i = 0; i < lower.vertices.size(); ++i)
      lower.pins.push_back({.vertex = i, .position = lower.vertices[i]});
    world.add_cloth(lower);
    ClothDef upper = sheet(0.4, 0.4, GetParam().upper, friction);
    const Real turn = GetParam().turn * std::numbers::pi / 180;
    const Vec3 start(-0.85, 1.05 * GetParam().thickness, 0);
    for (Vec3& p : upper.vertices) p = Eigen::AngleAxisd(turn, Vec3::UnitY()) * p + start;
    upper.velocity = {speed, 0, 0};
    const ClothHandle handle = world.add_cloth(upper);
    const auto steps = std::lround(duration / GetParam().step);
    for (long i = 0; i < steps; ++i) ASSERT_EQ(world.step(GetParam().step).cloth.crossings, 0u) << i;
    const ClothView state = world.cloth(handle);
    Real mass = 0;
    moved_ = velocity_ = 0;
    for (std::size_t i = 0; i < upper.masses.size(); ++i) {
      mass += upper.masses[i];
      moved_ += upper.masses[i] * (state.points[i].x() - start.x());
      velocity_ += upper.masses[i] * state.velocities[i].x();
    }
    moved_ /= mass;
    velocity_ /= mass;
  }

  Real moved_ = 0, velocity_ = 0;
};

TEST_P(ClothOnCloth, KeepsItsSpeedWithoutFriction) {
  const Real speed = 1000 * GetParam().thickness;  // about one thickness per sub-step
  slide(speed, 0, 0, 0.5 / speed);
  EXPECT_NEAR(velocity_ / speed, 1, 0.01);
}

// The moves of a sub-step are longer than the distance between the layers.
TEST_P(ClothOnCloth, KeepsItsSpeedIfItIsFast) {
  const Real speed = 4000 * GetParam().thickness;
  slide(speed, 0, 0, 0.5 / speed);
  EXPECT_NEAR(velocity_ / speed, 1, 0.01);
}

TEST_P(ClothOnCloth, StopsWhereFrictionHasTakenItsEnergy) {
  const Real speed = 1.5, friction = 0.3;
  slide(speed, friction, 0, 0.7);
  EXPECT_NEAR(moved_ / (speed * speed / (2 * friction * kGravity)), 1, 0.03);
  EXPECT_NEAR(velocity_, 0, 0.01);
}

TEST_P(ClothOnCloth, AcceleratesDownASlope) {
  const Real slope = std::numbers::pi / 6, duration = 0.5;
  for (const Real friction : {0.0, 0.3}) {
    slide(0, friction, slope, duration);
    const Real expected = kGravity * (std::sin(slope) - friction * std::cos(slope));
    EXPECT_NEAR(velocity_ / (expected * duration), 1, 0.03) << friction;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Layers, ClothOnCloth,
    testing::Values(Sliding{"aligned", ClothIntegrator::relaxed, 1.0 / 240, 0.002, 0.05, 0.05, 0},
                    Sliding{"thin", ClothIntegrator::relaxed, 1.0 / 60, 0.001, 0.1, 0.04, 5},
                    Sliding{"turned", ClothIntegrator::relaxed, 1.0 / 240, 0.003, 0.06, 0.025, 30},
                    Sliding{"implicit_aligned", ClothIntegrator::implicit, 1.0 / 60, 0.002, 0.05, 0.05, 0},
                    Sliding{"implicit_turned", ClothIntegrator::implicit, 1.0 / 240, 0.004, 0.1, 0.05, 45}),
    [](const auto& sliding) { return sliding.param.name; });

}  // namespace
}  // namespace offstage::sim
