#include "sim/dynamics/integrator.h"

#include <algorithm>
#include <cmath>

#include "sim/dynamics/adaptive.h"
#include "sim/dynamics/flat_array.h"
#include "sim/dynamics/implicit_euler.h"

namespace offstage::sim {
namespace {

void count(IntegratorWorkspace& work, uint64_t evaluations) {
  ++work.report.steps;
  work.report.evaluations += evaluations;
}

class ExplicitEuler final : public Integrator {
 public:
  int order() const override { return 1; }
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    work.dx.resize(x.size());
    work.dp.resize(p.size());
    system.velocity(t, x, p, work.dx);
    system.force(t, x, p, work.dp);
    array(x) += h * array(work.dx);
    array(p) += h * array(work.dp);
    count(work, 1);
  }
};

class SymplecticEuler final : public Integrator {
 public:
  int order() const override { return 1; }
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    work.dx.resize(x.size());
    work.dp.resize(p.size());
    system.force(t, x, p, work.dp);
    array(p) += h * array(work.dp);
    system.velocity(t, x, p, work.dx);
    array(x) += h * array(work.dx);
    count(work, 1);
  }
};

class Leapfrog final : public Integrator {
 public:
  int order() const override { return 2; }
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    for (auto* v : {&work.x, &work.dx}) v->resize(x.size());
    for (auto* v : {&work.p, &work.dp, &work.damping}) v->resize(p.size());
    system.velocity(t, x, p, work.dx);
    array(work.x) = array(x) + h / 2 * array(work.dx);
    // work.p is set to the mean of p over the step.
    if (system.force_and_damping(t + h / 2, work.x, p, work.dp, work.damping)) {
      for (std::size_t i = 0; i < p.size(); ++i) {
        const DampedKick kick(h, work.damping[i]);
        work.p[i] = p[i] + kick.mean * work.dp[i];
        p[i] += kick.end * work.dp[i];
      }
      count(work, 1);
    } else {
      system.force(t, x, p, work.dp);
      array(work.p) = array(p) + h / 2 * array(work.dp);
      system.force(t + h / 2, work.x, work.p, work.dp);
      array(work.p) = array(p) + h / 2 * array(work.dp);
      array(p) += h * array(work.dp);
      count(work, 2);
    }
    system.velocity(t + h / 2, work.x, work.p, work.dx);
    array(x) += h * array(work.dx);
  }
};

class Midpoint final : public Integrator {
 public:
  int order() const override { return 2; }
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    work.x.resize(x.size());
    work.p.resize(p.size());
    work.dx.resize(x.size());
    work.dp.resize(p.size());
    system.velocity(t, x, p, work.dx);
    system.force(t, x, p, work.dp);
    array(work.x) = array(x) + h / 2 * array(work.dx);
    array(work.p) = array(p) + h / 2 * array(work.dp);
    system.velocity(t + h / 2, work.x, work.p, work.dx);
    system.force(t + h / 2, work.x, work.p, work.dp);
    array(x) += h * array(work.dx);
    array(p) += h * array(work.dp);
    count(work, 2);
  }
};

class RungeKutta4 final : public Integrator {
 public:
  int order() const override { return 4; }
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    for (auto* v : {&work.x, &work.dx, &work.sum_x}) v->resize(x.size());
    for (auto* v : {&work.p, &work.dp, &work.sum_p}) v->resize(p.size());
    array(work.x) = array(x);
    array(work.p) = array(p);
    array(work.sum_x).setZero();
    array(work.sum_p).setZero();

    // k1..k4: time of each slope within the step, and its weight in the mean.
    constexpr Real kReach[] = {0, 0.5, 0.5, 1}, kWeight[] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    for (int k = 0; k < 4; ++k) {
      if (k > 0) {
        array(work.x) = array(x) + kReach[k] * h * array(work.dx);
        array(work.p) = array(p) + kReach[k] * h * array(work.dp);
      }
      system.velocity(t + kReach[k] * h, work.x, work.p, work.dx);
      system.force(t + kReach[k] * h, work.x, work.p, work.dp);
      array(work.sum_x) += kWeight[k] * array(work.dx);
      array(work.sum_p) += kWeight[k] * array(work.dp);
    }
    array(x) += h * array(work.sum_x);
    array(p) += h * array(work.sum_p);
    count(work, 4);
  }
};

}  // namespace

bool DynamicSystem::force_and_damping(Real, std::span<const Real>, std::span<const Real>, std::span<Real>,
                                      std::span<Real>) const {
  return false;
}

void DynamicSystem::jacobian(Real t, std::span<const Real> x, std::span<const Real> p,
                             SparseEntries& entries) const {
  const std::size_t n = x.size(), size = n + p.size();
  std::vector<Real> y(size), low(size), high(size);
  std::copy(x.begin(), x.end(), y.begin());
  std::copy(p.begin(), p.end(), y.begin() + static_cast<std::ptrdiff_t>(n));
  const std::span all(y);
  const auto evaluate = [&](std::vector<Real>& out) {
    velocity(t, all.first(n), all.subspan(n), std::span(out).first(n));
    force(t, all.first(n), all.subspan(n), std::span(out).subspan(n));
  };
  for (std::size_t column = 0; column < size; ++column) {
    const Real value = y[column], d = 1e-6 * std::max(1.0, std::abs(value));
    y[column] = value - d;
    evaluate(low);
    y[column] = value + d;
    evaluate(high);
    y[column] = value;
    for (std::size_t row = 0; row < size; ++row)
      entries.emplace_back(static_cast<int>(row), static_cast<int>(column), (high[row] - low[row]) / (2 * d));
  }
}

const Integrator& integrator(IntegratorKind kind) {
  static const ExplicitEuler explicit_euler;
  static const SymplecticEuler symplectic_euler;
  static const Leapfrog leapfrog;
  static const Midpoint midpoint;
  static const RungeKutta4 rk4;
  static const ImplicitEuler implicit_euler;
  static const StepDoubling adaptive_euler(explicit_euler), adaptive_midpoint(midpoint), adaptive_rk4(rk4);
  static const DormandPrince dormand_prince;
  switch (kind) {
    case IntegratorKind::explicit_euler:
      return explicit_euler;
    case IntegratorKind::symplectic_euler:
      return symplectic_euler;
    case IntegratorKind::leapfrog:
      return leapfrog;
    case IntegratorKind::midpoint:
      return midpoint;
    case IntegratorKind::rk4:
      break;
    case IntegratorKind::implicit_euler:
      return implicit_euler;
    case IntegratorKind::adaptive_euler:
      return adaptive_euler;
    case IntegratorKind::adaptive_midpoint:
      return adaptive_midpoint;
    case IntegratorKind::adaptive_rk4:
      return adaptive_rk4;
    case IntegratorKind::dormand_prince:
      return dormand_prince;
  }
  return rk4;
}

}  // namespace offstage::sim
