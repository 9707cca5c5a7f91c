#include "sim/dynamics/integrator.h"

namespace offstage::sim {
namespace {

using Array = Eigen::Map<Eigen::ArrayXd>;

Array array(std::span<Real> s) {
  return {s.data(), static_cast<Eigen::Index>(s.size())};
}

class ExplicitEuler final : public Integrator {
 public:
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    work.dx.resize(x.size());
    work.dp.resize(p.size());
    system.velocity(t, x, p, work.dx);
    system.force(t, x, p, work.dp);
    array(x) += h * array(work.dx);
    array(p) += h * array(work.dp);
  }
};

class SymplecticEuler final : public Integrator {
 public:
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    work.dx.resize(x.size());
    work.dp.resize(p.size());
    system.force(t, x, p, work.dp);
    array(p) += h * array(work.dp);
    system.velocity(t, x, p, work.dx);
    array(x) += h * array(work.dx);
  }
};

class Midpoint final : public Integrator {
 public:
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
  }
};

class RungeKutta4 final : public Integrator {
 public:
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override {
    for (auto* v : {&work.x, &work.dx, &work.sum_x}) v->resize(x.size());
    for (auto* v : {&work.p, &work.dp, &work.sum_p}) v->resize(p.size());
    array(work.x) = array(x);
    array(work.p) = array(p);
    array(work.sum_x).setZero();
    array(work.sum_p).setZero();

    // k1..k4: where in the step each slope is taken, and its weight in the mean.
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
  }
};

}  // namespace

const Integrator& integrator(IntegratorKind kind) {
  static const ExplicitEuler explicit_euler;
  static const SymplecticEuler symplectic_euler;
  static const Midpoint midpoint;
  static const RungeKutta4 rk4;
  switch (kind) {
    case IntegratorKind::explicit_euler:
      return explicit_euler;
    case IntegratorKind::symplectic_euler:
      return symplectic_euler;
    case IntegratorKind::midpoint:
      return midpoint;
    case IntegratorKind::rk4:
      break;
  }
  return rk4;
}

}  // namespace offstage::sim
