/// A ball dropped on the ground, and the oblique impact, with the full simulation.

#include <cmath>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kBallRadius = 0.05;

struct Drop {
  std::vector<Real> apexes;  // heights above the rest position after each bounce
  Real rest_height;          // height at the end
};

/// Drops a particle from 1 m onto a shape whose top is at y = 0.
Drop drop(const Shape& shape, Real depth, Real e, Real seconds) {
  World world;
  world.add_body(
      {.shape = shape, .motion = MotionType::static_body, .pose = {Vec3(0, -depth, 0)}, .restitution = e});
  const auto system = world.add_particle_system({.integrator = IntegratorKind::rk4});
  world.add_particle(system, {.position = {0, 1 + kBallRadius, 0}, .radius = kBallRadius, .restitution = e});
  Drop result;
  Real last_v = 0;
  while (world.time() < seconds) {
    world.step(1.0 / 240);
    const Real y = world.particles(system).position[0].y() - kBallRadius,
               v = world.particles(system).velocity[0].y();
    // The apex of the parabola from any point on it: y + v^2 / 2g.
    if (last_v > 0 && v <= 0 && y > 1e-3) result.apexes.push_back(y + v * v / (2 * 9.81));
    last_v = v;
  }
  result.rest_height = world.particles(system).position[0].y() - kBallRadius;
  return result;
}

TEST(Bounce, ApexesFallWithTheSquareOfTheRestitution) {
  for (Real e : {0.9, 0.5}) {
    const Drop d = drop(Plane{}, 0, e, 4);
    ASSERT_GE(d.apexes.size(), 4u);
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(d.apexes[k], std::pow(e, 2.0 * (Real(k) + 1)), 1e-3) << e << ' ' << k;
  }
}

TEST(Bounce, ElasticBallComesBackToItsHeightAgainAndAgain) {
  const Drop d = drop(Plane{}, 0, 1, 10);
  ASSERT_GE(d.apexes.size(), 10u);
  for (Real apex : d.apexes) EXPECT_NEAR(apex, 1, 1e-3);
}

TEST(Bounce, WithoutRestitutionItRestsAtOnceAndOtherwiseEventually) {
  const std::vector<std::pair<Shape, Real>> grounds = {
      {Plane{}, 0}, {Box{{1, 1, 1}}, 0.5}, {Sphere{2}, 2}, {Capsule{0.5, 1}, 1}, {Cylinder{1, 1}, 0.5}};
  for (const auto& [shape, depth] : grounds) {
    EXPECT_NEAR(drop(shape, depth, 0, 1).rest_height, 0, 1e-3) << shape.index();
    EXPECT_NEAR(drop(shape, depth, 0.5, 4).rest_height, 0, 1e-6) << shape.index();
  }
}

// Without gravity, only the impact changes the velocity: P5 to rounding.
TEST(ObliqueImpact, StickAndSlideThroughTheWorld) {
  constexpr Real kE = 0.5;
  const Real critical = 2 / ((1 + kE) * 3);
  for (Real mu : {0.5 * critical, 1.5 * critical}) {
    World world({.gravity = Vec3::Zero()});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = mu});
    const auto system = world.add_particle_system({});
    world.add_particle(system,
                       {.position = {0, 0.1, 0}, .velocity = {2, -3, 0}, .restitution = kE, .friction = mu});
    const StepReport report = world.step(0.1);
    EXPECT_EQ(report.particles.collisions, 1u);
    const Vec3 expected(mu < critical ? 2 - mu * (1 + kE) * 3 : 0, kE * 3, 0);
    EXPECT_NEAR((world.particles(system).velocity[0] - expected).norm(), 0, 1e-12);
    const Real hit = 0.09 / 3;
    EXPECT_NEAR(
        (world.particles(system).position[0] - Vec3(2 * hit, 0.01, 0) - (0.1 - hit) * expected).norm(), 0,
        1e-9);
  }
}

}  // namespace
}  // namespace offstage::sim
