#pragma once
/// Backward Euler (physics N2): y1 = y0 + h f(t + h, y1), solved by Newton's method with a sparse
/// factorisation of 1 - h df/dy, whose pattern is the graph of what acts on what.

#include "sim/dynamics/integrator.h"

namespace offstage::sim {

/// Where Newton's method does not converge, the step is halved, down to h / 64; what then still does not
/// converge is taken as the last iterate, and counted as missed.
class ImplicitEuler final : public Integrator {
 public:
  int order() const override { return 1; }
  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const override;
};

}  // namespace offstage::sim
