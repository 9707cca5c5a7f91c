#pragma once
/// Backward Euler (physics N2): y1 = y0 + h f(t + h, y1), solved by Newton's method with a sparse
/// factorization of 1 - h df/dy. The pattern of the matrix is the graph of the forces between objects.

#include "sim/dynamics/integrator.h"

namespace offstage::sim {

/// If Newton's method does not converge, the step is halved, down to h / 64. If it still does not converge,
/// the last iterate is used and counted in IntegratorReport::missed.
class ImplicitEuler final : public Integrator {
 public:
  int order() const override { return 1; }
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override;
};

}  // namespace offstage::sim
