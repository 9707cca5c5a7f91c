/// Bodies in free motion, compared with closed forms for every integrator.

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "sim/world/coupled_system.h"

namespace offstage::sim {
namespace {

/// Returns a body that was integrated with equal steps. The adaptive integrators also take these steps,
/// because their tolerance is infinite.
RigidBody moved(const RigidBody& start, const Vec3& gravity, IntegratorKind kind, int steps, Real time) {
  WorldState world;
  world.def.gravity = gravity;
  const BodyHandle handle = world.bodies.insert(std::make_unique<Body>());
  world.bodies[handle]->rigid = start;
  CoupledSystem system(world);
  for (int i = 0; i < steps; ++i)
    system.step(integrator(kind), i * time / steps, time / steps, std::numeric_limits<Real>::infinity());
  return world.bodies[handle]->rigid;
}

struct Order {
  IntegratorKind kind;
  Real order;
};

// Step doubling corrects its result by its own error estimate, which raises the order by one.
constexpr std::array kOrders = {
    Order{IntegratorKind::explicit_euler, 1},    Order{IntegratorKind::symplectic_euler, 1},
    Order{IntegratorKind::midpoint, 2},          Order{IntegratorKind::rk4, 4},
    Order{IntegratorKind::implicit_euler, 1},    Order{IntegratorKind::adaptive_euler, 2},
    Order{IntegratorKind::adaptive_midpoint, 3}, Order{IntegratorKind::adaptive_rk4, 5},
    Order{IntegratorKind::dormand_prince, 5}};

// v(t) = v_t + (v0 - v_t) e^(-t/tau), x(t) = v_t t + (v0 - v_t) tau (1 - e^(-t/tau)), tau = m/k, v_t = tau g.
TEST(FreeFallOfABody, WithDragErrorFallsWithTheOrderOfTheIntegrator) {
  constexpr Real kTime = 2;
  RigidBody start;
  start.mass = 2;
  start.linear_drag = 3;
  const Vec3 gravity(0, -9.81, 0), v0(3, 4, 0);
  start.set_velocity(v0, Vec3::Zero());
  const Real tau = 2.0 / 3, decay = std::exp(-kTime / tau);
  const Vec3 terminal = tau * gravity;
  const Vec3 exact = terminal * kTime + (v0 - terminal) * tau * (1 - decay);
  for (const auto& [kind, order] : kOrders) {
    const auto error = [&, kind = kind](int steps) {
      return (moved(start, gravity, kind, steps, kTime).position - exact).norm();
    };
    const int steps = order < 2 ? 200 : 40;
    EXPECT_NEAR(std::log2(error(steps) / error(2 * steps)), order, 0.1) << static_cast<int>(kind);
  }
}

TEST(FreeFallOfABody, WithoutDragIsExactForEveryIntegrator) {
  RigidBody start;
  const Vec3 gravity(0, -9.81, 0), v0(3, 4, 0), w(2, 5, -1);
  start.set_velocity(v0, w);
  const Quat turned(Eigen::AngleAxisd(2 * w.norm(), w.normalized()));
  for (const auto& [kind, order] : kOrders) {
    const RigidBody end = moved(start, gravity, kind, 480, 2);
    EXPECT_NEAR((end.position - 2 * (v0 + gravity)).norm(), 0, 1e-12);
    EXPECT_NEAR(std::abs(end.orientation.dot(turned)), 1, 1e-13);
  }
}

/// Returns a body with rotational symmetry about z that rotates about a tilted axis.
RigidBody symmetric_top() {
  RigidBody top;
  top.inertia = Vec3(0.5, 0.5, 0.2).asDiagonal();
  top.inverse_inertia = top.inertia.inverse();
  top.set_velocity(Vec3::Zero(), {1, 0, 8});
  return top;
}

/// Returns the exact orientation of the top: precession about H with the rate |H| / I_across, after a spin
/// about z with the rate w_z (1 - I_z / I_across).
Quat exact_top(const RigidBody& top, Real t) {
  const Vec3 H = top.angular_momentum;
  const Vec3 w = top.angular_velocity();
  const Quat precession(Eigen::AngleAxisd(H.norm() / 0.5 * t, H.normalized()));
  const Quat spin(Eigen::AngleAxisd(w.z() * (1 - 0.2 / 0.5) * t, Vec3::UnitZ()));
  return precession * spin;
}

TEST(SymmetricTop, TurnsTorqueFreeAsTheClosedFormWithTheOrderOfTheIntegrator) {
  const RigidBody top = symmetric_top();
  constexpr Real kTime = 2;
  const Quat exact = exact_top(top, kTime);
  for (const auto& [kind, order] : kOrders) {
    // The error is the sine of half the angle between both orientations. Unlike an arc cosine, it is accurate
    // for small angles.
    const auto error = [&, kind = kind](int steps) {
      return (moved(top, Vec3::Zero(), kind, steps, kTime).orientation * exact.conjugate()).vec().norm();
    };
    // The step doubling methods, and Euler's method with a normalized quaternion, may exceed their order but
    // never fall below it.
    const int steps = order < 2 ? 2000 : 400;
    EXPECT_GT(std::log2(error(steps) / error(2 * steps)), order - 0.15) << static_cast<int>(kind);
  }
}

TEST(SymmetricTop, PrecessesForAMinuteWithinAThousandth) {
  const RigidBody top = symmetric_top();
  for (IntegratorKind kind : {IntegratorKind::rk4, IntegratorKind::dormand_prince}) {
    const RigidBody end = moved(top, Vec3::Zero(), kind, 240 * 60, 60);
    const Quat difference = end.orientation * exact_top(top, 60).conjugate();
    EXPECT_LT(2 * difference.vec().norm(), 1e-3) << static_cast<int>(kind);
    EXPECT_EQ(end.angular_momentum, top.angular_momentum);
  }
}

}  // namespace
}  // namespace offstage::sim
