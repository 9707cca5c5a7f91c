/// Torque-free rotation and mass properties, compared with closed forms.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"
#include "tests/meshes.h"

namespace offstage::sim {
namespace {

/// Returns the complete elliptic integral of the first kind with the parameter m = k^2, by the
/// arithmetic-geometric mean.
Real elliptic_k(Real m) {
  Real a = 1, b = std::sqrt(1 - m);
  for (int i = 0; i < 40 && a != b; ++i) {
    const Real mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return std::numbers::pi / (2 * a);
}

// A box with three different moments I1 < I2 < I3 that rotates about its middle axis flips like a T-handle.
// The time between flips is half the period of w2, 4 K(m) / p (Landau and Lifshitz, Mechanics, section 37;
// H^2 > 2 E I2).
TEST(THandle, FlipsWithThePeriodOfTheEllipticIntegralAndKeepsEnergyAndMomentum) {
  World world({.gravity = Vec3::Zero()});
  const auto body =
      world.add_body({.shape = Box{{0.1, 0.3, 0.5}}, .angular_velocity = {0.02, 5, 0.05}, .density = 600});
  // The thin axis x has the largest moment, z the smallest.
  const Mat3 inertia = mass_properties(Shape(Box{{0.1, 0.3, 0.5}})).inertia * 600;
  const Real I1 = inertia(2, 2), I2 = inertia(1, 1), I3 = inertia(0, 0);
  const Real w1 = 0.05, w2 = 5, w3 = 0.02;
  const Real E2 = I1 * w1 * w1 + I2 * w2 * w2 + I3 * w3 * w3;
  const Real H2 = I1 * I1 * w1 * w1 + I2 * I2 * w2 * w2 + I3 * I3 * w3 * w3;
  // For H^2 > 2 E I2 the motion circles the axis of I3; otherwise the roles of I1 and I3 are exchanged.
  const bool about_3 = H2 > E2 * I2;
  const Real A = about_3 ? I1 : I3, C = about_3 ? I3 : I1;
  const Real m = (I2 - A) * (E2 * C - H2) / ((C - I2) * (H2 - E2 * A));
  const Real rate = std::sqrt((C - I2) * (H2 - E2 * A) / (A * I2 * C));
  const Real half_period = 2 * elliptic_k(m) / rate;

  const Energy e0 = world.energy();
  const Vec3 h0 = world.body(body).angular_momentum;
  std::vector<Real> flips;
  Real last = 1;
  constexpr Real kFrame = 1.0 / 240;
  for (int i = 0; i < 60 * 240; ++i) {
    world.step(kFrame);
    const BodyState s = world.body(body);
    const Real w_middle = s.pose.vector_to_body(s.angular_velocity).y();
    if (w_middle * last < 0) flips.push_back(world.time() - kFrame * w_middle / (w_middle - last));
    last = w_middle;
  }
  const BodyState s = world.body(body);
  EXPECT_NEAR(world.energy().total() / e0.total(), 1, 1e-6);
  EXPECT_NEAR(s.angular_momentum.norm() / h0.norm(), 1, 1e-6);
  EXPECT_LT((s.angular_momentum - h0).norm() / h0.norm(), 1e-12);
  ASSERT_GT(flips.size(), 5u);
  for (std::size_t i = 1; i < flips.size(); ++i)
    EXPECT_NEAR((flips[i] - flips[i - 1]) / half_period, 1, 1e-3);
}

// A symmetric body: its axis precesses about H at the rate H / I_across, at a constant angle.
TEST(SymmetricTop, PrecessesFreelyAtTheClosedFormRate) {
  World world({.gravity = Vec3::Zero()});
  const auto top = world.add_body({.shape = Cylinder{0.2, 0.05}, .angular_velocity = {2, 20, 0}, .mass = 1});
  const Mat3 unit = mass_properties(Shape(Cylinder{0.2, 0.05})).inertia;
  const Real across = unit(0, 0) / (std::numbers::pi * 0.04 * 0.05);
  const Vec3 H = world.body(top).angular_momentum, axis = H.normalized();
  const Real rate = H.norm() / across;
  const Vec3 start = Vec3::UnitY();
  for (int i = 1; i <= 240; ++i) {
    world.step(1.0 / 240);
    const Vec3 y = world.body(top).pose.vector_to_world(Vec3::UnitY());
    const Vec3 expected = Eigen::AngleAxisd(rate * world.time(), axis) * start;
    ASSERT_NEAR((y - expected).norm(), 0, 0.005 * (start - start.dot(axis) * axis).norm()) << i;
  }
}

TEST(AngularDrag, SlowsTheSpinExponentially) {
  World world({.gravity = Vec3::Zero()});
  const auto ball = world.add_body({.shape = Sphere{0.5},
                                    .velocity = {3, 0, 0},
                                    .angular_velocity = {0, 0, 7},
                                    .mass = 2,
                                    .linear_drag = 1,
                                    .angular_drag = 0.1});
  for (int i = 0; i < 120; ++i) world.step(1.0 / 60);
  EXPECT_NEAR(world.body(ball).velocity.x(), 3 * std::exp(-2 * 1 / 2.0), 1e-9);
  EXPECT_NEAR(world.body(ball).angular_velocity.z(), 7 * std::exp(-2 * 0.1 / (0.4 * 2 * 0.25)), 1e-8);
}

// v' = k (wind - v) / m
TEST(LinearDrag, ActsRelativeToTheAir) {
  const Vec3 wind(1, 0, -2);
  for (const IntegratorKind kind :
       {IntegratorKind::rk4, IntegratorKind::implicit_euler, IntegratorKind::leapfrog}) {
    World world({.gravity = Vec3::Zero(), .wind = wind, .integrator = kind});
    const auto ball =
        world.add_body({.shape = Sphere{0.5}, .velocity = {5, 0, 0}, .mass = 2, .linear_drag = 1});
    for (int i = 0; i < 120; ++i) world.step(1.0 / 60);
    const Vec3 expected = wind + std::exp(-1.0) * (Vec3(5, 0, 0) - wind);
    EXPECT_LT((world.body(ball).velocity - expected).norm(),
              kind == IntegratorKind::implicit_euler ? 2e-3 * expected.norm() : 1e-5)
        << static_cast<int>(kind);
  }
}

struct Exact {
  Real volume, polar;  // moment of inertia about Y
};

void expect_second_order(const Exact& exact, const std::function<TriangleMesh(uint32_t)>& mesh) {
  const MassProperties coarse = mass_properties(mesh(32)), fine = mass_properties(mesh(64));
  const auto order = [](Real a, Real b, Real c) { return std::log2(std::abs(a - c) / std::abs(b - c)); };
  EXPECT_NEAR(order(coarse.volume, fine.volume, exact.volume), 2, 0.1);
  EXPECT_NEAR(order(coarse.inertia(1, 1), fine.inertia(1, 1), exact.polar), 2, 0.1);
  EXPECT_NEAR(fine.centre.norm(), 0, 1e-12);
}

TEST(MassProperties, SphereAndTorusMeshesConvergeWithTheSquareOfTheEdge) {
  const Real volume = 4.0 / 3 * std::numbers::pi;
  expect_second_order({volume, 0.4 * volume}, [](uint32_t n) { return sphere_mesh(1, 2 * n, n); });
  constexpr Real R = 1, r = 0.3;
  const Real torus = 2 * std::numbers::pi * std::numbers::pi * R * r * r;
  expect_second_order({torus, torus * (R * R + 0.75 * r * r)},
                      [](uint32_t n) { return torus_mesh(R, r, 2 * n, n); });
}

}  // namespace
}  // namespace offstage::sim
