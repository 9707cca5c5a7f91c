#include "sim/dynamics/free_body.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

Vec3 random_vector(const Scatter& s, uint64_t i, uint64_t k, Real size) {
  return size * Vec3(2 * s.uniform(i, k) - 1, 2 * s.uniform(i, k + 1) - 1, 2 * s.uniform(i, k + 2) - 1);
}

RigidBody random_body(const Scatter& s, uint64_t i) {
  RigidBody body;
  body.mass = 0.5 + s.uniform(i, 0);
  body.centre = random_vector(s, i, 1, 0.3);
  const Vec3 moments(1 + s.uniform(i, 4), 1 + s.uniform(i, 5), 1 + s.uniform(i, 6));
  const Mat3 axes = Quat(Eigen::Vector4d(s.uniform(i, 7), 0.3, -0.2, 0.5).normalized()).toRotationMatrix();
  body.inertia = axes * moments.asDiagonal() * axes.transpose();
  body.inverse_inertia = body.inertia.inverse();
  body.linear_drag = s.uniform(i, 8);
  body.angular_drag = s.uniform(i, 9);
  body.position = random_vector(s, i, 10, 2);
  body.orientation =
      Quat(Eigen::Vector4d(s.uniform(i, 13) - 0.5, s.uniform(i, 14) - 0.5, 0.4, 0.6)).normalized();
  body.momentum = random_vector(s, i, 15, 3);
  body.angular_momentum = random_vector(s, i, 18, 3);
  return body;
}

TEST(Rotation, IsTheExponentialMapForAnglesSmallAndLarge) {
  const Scatter s{3};
  for (uint64_t i = 0; i < 2000; ++i) {
    const Vec3 axis = random_vector(s, i, 0, 1).normalized();
    const Real angle = std::pow(10.0, -8 + 10 * s.uniform(i, 3));
    const Quat exact(Eigen::AngleAxisd(angle, axis)), q = rotation(angle / 0.25 * axis, 0.25);
    // A large angle has the rounding error of its own magnitude.
    ASSERT_NEAR((q.coeffs() - exact.coeffs()).norm(), 0, 1e-15 * std::max(4.0, angle)) << angle;
    ASSERT_NEAR(q.norm(), 1, 1e-15);
  }
  EXPECT_EQ(rotation(Vec3::Zero(), 1).coeffs(), Quat::Identity().coeffs());
}

TEST(FreeBody, JacobianAgreesWithDifferences) {
  ForceDef grab{.effect = Grab{.point = {0.2, -0.1, 0.3},
                               .track = {.keys = {{.pose = {Vec3(1, 2, 3)}}}},
                               .stiffness = 30,
                               .damping = 4}};
  ForceDef wind{.effect = WindField{.wind = {1, 0, 2}, .drag = 0.7}};
  const std::vector<ActiveForce> active = {{&grab, {}}, {&wind, {}}};
  const BodyForces forces{{0, -9.81, 0}, active};
  const Scatter s{5};
  for (uint64_t i = 0; i < 20; ++i) {
    const RigidBody body = random_body(s, i);
    std::array<Real, kBodyX> x;
    std::array<Real, kBodyP> p;
    load(body, x, p);
    // quaternions within Runge-Kutta stages are not normalized
    for (std::size_t k = 3; k < 7; ++k) x[k] *= 0.9;
    const FreeBody system(body, forces);
    Eigen::SparseMatrix<Real> exact(13, 13), differences(13, 13);
    SparseEntries entries;
    system.jacobian(0, x, p, entries);
    exact.setFromTriplets(entries.begin(), entries.end());
    entries.clear();
    system.DynamicSystem::jacobian(0, x, p, entries);
    differences.setFromTriplets(entries.begin(), entries.end());
    ASSERT_NEAR((Eigen::MatrixXd(exact) - Eigen::MatrixXd(differences)).cwiseAbs().maxCoeff(), 0, 1e-6);
  }
}

// The closed form does not depend on the step: one step of two seconds gives the same place as many short
// ones.
TEST(FreeBody, ACubeFliesAndTurnsExactlyInStepsOfAnyLength) {
  const Vec3 g(0, -9.81, 0), v(3, 8, -1), w(4, -7, 2);
  for (int steps : {1, 7, 480}) {
    RigidBody cube;
    cube.inertia = 0.4 * Mat3::Identity();
    cube.inverse_inertia = 2.5 * Mat3::Identity();
    cube.set_velocity(v, w);
    IntegratorWorkspace work;
    const BodyForces forces{g, {}};
    for (int i = 0; i < steps; ++i)
      fly(cube, forces, integrator(IntegratorKind::explicit_euler), 2.0 * i / steps, 2.0 / steps, work);
    EXPECT_NEAR((cube.position - (2 * v + 2 * g)).norm(), 0, 1e-12);
    EXPECT_NEAR((cube.velocity() - (v + 2 * g)).norm(), 0, 1e-12);
    const Quat turned(Eigen::AngleAxisd(2 * w.norm(), w.normalized()));
    EXPECT_NEAR(cube.orientation.angularDistance(turned), 0, 1e-7);  // accuracy of an arc cosine near 1
    EXPECT_NEAR(std::abs(cube.orientation.dot(turned)), 1, 1e-13);
    EXPECT_EQ(work.report.evaluations, 0u);
  }
}

TEST(FreeBody, OneAtRestWithoutForcesKeepsEveryBit) {
  const Scatter s{9};
  RigidBody body = random_body(s, 1);
  body.linear_drag = body.angular_drag = 0;
  body.momentum.setZero();
  body.angular_momentum.setZero();
  const RigidBody before = body;
  IntegratorWorkspace work;
  const BodyForces forces{Vec3::Zero(), {}};
  for (int i = 0; i < 1000; ++i) fly(body, forces, integrator(IntegratorKind::rk4), 0, 1.0 / 240, work);
  EXPECT_EQ(body.position, before.position);
  EXPECT_EQ(body.orientation.coeffs(), before.orientation.coeffs());
}

// A spin of 100 revolutions a second for ten minutes: the rounding error grows at most linearly with the
// steps.
TEST(FreeBody, TheOrientationStaysAUnitQuaternion) {
  RigidBody ball;
  ball.set_velocity(Vec3::Zero(), {600, 100, -300});
  IntegratorWorkspace work;
  const BodyForces forces{Vec3::Zero(), {}};
  for (int i = 0; i < 144000; ++i) {
    fly(ball, forces, integrator(IntegratorKind::rk4), 0, 1.0 / 240, work);
    ASSERT_NEAR(ball.orientation.norm(), 1, 1e-15);
  }
}

}  // namespace
}  // namespace offstage::sim
