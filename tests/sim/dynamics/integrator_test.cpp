#include "sim/dynamics/integrator.h"

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

/// x'' = -x - 0.2 x', from x = 1 at rest.
class Oscillator final : public DynamicSystem {
 public:
  static constexpr Real kDamping = 0.2;

  void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
    dx[0] = p[0];
  }
  void force(Real, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const override {
    dp[0] = -x[0] - kDamping * p[0];
  }
  static Real exact(Real t) {
    const Real a = kDamping / 2, w = std::sqrt(1 - a * a);
    return std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t));
  }
};

/// Integrates with equal steps. The adaptive integrators do so too, because their tolerance is infinite.
Real error(IntegratorKind kind, int steps) {
  constexpr Real kTime = 2;
  std::array<Real, 1> x = {1}, p = {0};
  IntegratorWorkspace work{.tolerance = std::numeric_limits<Real>::infinity()};
  for (int i = 0; i < steps; ++i)
    integrator(kind).step(Oscillator(), i * kTime / steps, kTime / steps, x, p, work);
  return std::abs(x[0] - Oscillator::exact(kTime));
}

TEST(Integrator, ObservedOrderOnADampedOscillator) {
  // Step doubling corrects its result by its own error estimate, which raises the order by one.
  for (const auto& [kind, order] :
       {std::pair(IntegratorKind::explicit_euler, 1.0), std::pair(IntegratorKind::symplectic_euler, 1.0),
        std::pair(IntegratorKind::midpoint, 2.0), std::pair(IntegratorKind::rk4, 4.0),
        std::pair(IntegratorKind::implicit_euler, 1.0), std::pair(IntegratorKind::adaptive_euler, 2.0),
        std::pair(IntegratorKind::adaptive_midpoint, 3.0), std::pair(IntegratorKind::adaptive_rk4, 5.0),
        std::pair(IntegratorKind::dormand_prince, 5.0)})
    EXPECT_NEAR(std::log2(error(kind, 40) / error(kind, 80)), order, 0.1)
        << "kind " << static_cast<int>(kind);
}

/// x' = 2 t, p' = 3 t^2: exact only if the stages are evaluated at their own times.
class TimeOnly final : public DynamicSystem {
 public:
  void velocity(Real t, std::span<const Real>, std::span<const Real>, std::span<Real> dx) const override {
    dx[0] = 2 * t;
  }
  void force(Real t, std::span<const Real>, std::span<const Real>, std::span<Real> dp) const override {
    dp[0] = 3 * t * t;
  }
};

TEST(Integrator, MidpointAndRungeKuttaAreExactForPolynomialsInTimeOfTheirDegree) {
  IntegratorWorkspace work;
  std::array<Real, 1> x = {0}, p = {0};
  integrator(IntegratorKind::midpoint).step(TimeOnly(), 1, 2, x, p, work);
  EXPECT_NEAR(x[0], 9 - 1, 1e-14);
  x = p = {0};
  integrator(IntegratorKind::rk4).step(TimeOnly(), 1, 2, x, p, work);
  EXPECT_NEAR(x[0], 9 - 1, 1e-14);
  EXPECT_NEAR(p[0], 27 - 1, 1e-13);
}

/// Symplectic Euler on x'' = -x conserves p^2 + x^2 - h x p exactly; explicit Euler multiplies the energy by
/// 1 + h^2 in each step.
TEST(Integrator, SymplecticEulerBoundsTheEnergyThatExplicitEulerPumps) {
  class Harmonic final : public DynamicSystem {
   public:
    void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
      dx[0] = p[0];
    }
    void force(Real, std::span<const Real> x, std::span<const Real>, std::span<Real> dp) const override {
      dp[0] = -x[0];
    }
  };
  constexpr Real kH = 0.1;
  IntegratorWorkspace work;
  std::array<Real, 1> x = {1}, p = {0}, y = {1}, q = {0};
  for (int i = 0; i < 1000; ++i) {
    integrator(IntegratorKind::symplectic_euler).step(Harmonic(), 0, kH, x, p, work);
    integrator(IntegratorKind::explicit_euler).step(Harmonic(), 0, kH, y, q, work);
  }
  EXPECT_NEAR(p[0] * p[0] + x[0] * x[0] - kH * x[0] * p[0], 1, 1e-12);
  EXPECT_NEAR((y[0] * y[0] + q[0] * q[0]) / std::pow(1 + kH * kH, 1000), 1, 1e-10);
}

constexpr std::array kAdaptive = {IntegratorKind::adaptive_euler, IntegratorKind::adaptive_midpoint,
                                  IntegratorKind::adaptive_rk4, IntegratorKind::dormand_prince};

// The step length found in one call is the initial step of the next.
TEST(Adaptive, RemembersItsStepBetweenCalls) {
  for (IntegratorKind kind : kAdaptive) {
    std::array<Real, 1> x = {1}, p = {0};
    IntegratorWorkspace work{.tolerance = 1e-6};
    integrator(kind).step(Oscillator(), 0, 0.5, x, p, work);
    const IntegratorReport first = work.report;
    EXPECT_GT(first.rejected, 0u);
    integrator(kind).step(Oscillator(), 0.5, 0.5, x, p, work);
    EXPECT_LE(work.report.rejected - first.rejected, first.rejected / 2) << static_cast<int>(kind);
    EXPECT_EQ(work.report.missed, 0u);
    EXPECT_NEAR(x[0], Oscillator::exact(1), 1e-4);
  }
}

/// A system whose derivatives are never finite.
class Broken final : public DynamicSystem {
 public:
  void velocity(Real, std::span<const Real>, std::span<const Real>, std::span<Real> dx) const override {
    dx[0] = std::numeric_limits<Real>::quiet_NaN();
  }
  void force(Real, std::span<const Real>, std::span<const Real>, std::span<Real> dp) const override {
    dp[0] = std::numeric_limits<Real>::infinity();
  }
};

TEST(Adaptive, AlwaysEndsAndCountsMissedTolerances) {
  for (IntegratorKind kind : kAdaptive) {
    std::array<Real, 1> x = {1}, p = {0};
    IntegratorWorkspace work;
    integrator(kind).step(Broken(), 0, 1, x, p, work);
    EXPECT_GT(work.report.missed, 0u);
    EXPECT_LE(work.report.steps, 16384u);
  }
  std::array<Real, 1> x = {1}, p = {0};
  IntegratorWorkspace work;
  integrator(IntegratorKind::implicit_euler).step(Broken(), 0, 1, x, p, work);
  EXPECT_EQ(work.report.steps, 64u);
  EXPECT_EQ(work.report.missed, 64u);
}

// One step of x'' = -k x has the closed form x1 = (x + h p) / (1 + h^2 k), p1 = (p - h k x) / (1 + h^2 k).
TEST(ImplicitEuler, SolvesALinearSpringExactly) {
  class Spring final : public DynamicSystem {
   public:
    void velocity(Real, std::span<const Real>, std::span<const Real> p, std::span<Real> dx) const override {
      dx[0] = p[0];
    }
    void force(Real, std::span<const Real> x, std::span<const Real>, std::span<Real> dp) const override {
      dp[0] = -1e6 * x[0];
    }
  };
  std::array<Real, 1> x = {0.3}, p = {-2};
  constexpr Real kH = 1.0 / 30, kD = 1 + kH * kH * 1e6;
  IntegratorWorkspace work;
  integrator(IntegratorKind::implicit_euler).step(Spring(), 0, kH, x, p, work);
  EXPECT_NEAR(x[0], (0.3 - kH * 2) / kD, 1e-15);
  EXPECT_NEAR(p[0], (-2 - kH * 1e6 * 0.3) / kD, 1e-11);
  EXPECT_LE(work.report.iterations, 3u);
  EXPECT_EQ(work.report.missed + work.report.rejected, 0u);
}

}  // namespace
}  // namespace offstage::sim
