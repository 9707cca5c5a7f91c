#pragma once
/// Implicit integrators (physics N2). Their equations y = c + h f(t, y) are solved by Newton's method with a
/// sparse factorization of 1 - h df/dy. The pattern of the matrix is the graph of the forces between objects.

#include "sim/core/types.h"
#include "sim/dynamics/integrator.h"

namespace offstage::sim {

/// If Newton's method does not converge, the step is halved, down to h / 64. If it still does not converge,
/// the last iterate is used and counted in IntegratorReport::missed.
class ImplicitIntegrator : public Integrator {
 public:
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const final;

 protected:
  class Equations;

 private:
  /// Computes the state `y` at t + h from the state `y0` at t. Returns false if Newton's method fails.
  virtual bool advance(Equations& equations, Real t, Real h, const Eigen::VectorXd& y0,
                       Eigen::VectorXd& y) const = 0;
};

/// Backward Euler: y1 = y0 + h f(t + h, y1).
class ImplicitEuler final : public ImplicitIntegrator {
 public:
  int order() const override { return 1; }

 private:
  bool advance(Equations& equations, Real t, Real h, const Eigen::VectorXd& y0,
               Eigen::VectorXd& y) const override;
};

/// The method of order 2 with two implicit stages of the same length that damps stiff motions completely
/// (Alexander, "Diagonally implicit Runge-Kutta methods for stiff O.D.E.'s", 1977).
class StiffRungeKutta final : public ImplicitIntegrator {
 public:
  int order() const override { return 2; }

 private:
  bool advance(Equations& equations, Real t, Real h, const Eigen::VectorXd& y0,
               Eigen::VectorXd& y) const override;
};

}  // namespace offstage::sim
