#pragma once
/// Fixed-step integrators behind one seam (physics N1, N3, N4 and symplectic Euler). A system is described by
/// two flat vectors: coordinates x and rates p (velocities or momenta), with dx/dt = velocity(t, x, p) and
/// dp/dt = force(t, x, p).

#include <memory>
#include <span>
#include <vector>

#include "sim/types.h"

namespace offstage::sim {

/// The right-hand side of the equations of motion. Implementations must not keep state between calls.
class DynamicSystem {
 public:
  virtual ~DynamicSystem() = default;
  /// dx = dx/dt at time t; sizes: x and dx equal, p as the state's.
  virtual void velocity(Real t, std::span<const Real> x, std::span<const Real> p,
                        std::span<Real> dx) const = 0;
  /// dp = dp/dt at time t.
  virtual void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const = 0;
};

/// Buffers an integrator needs between stages; keep one per thread to avoid allocation.
struct IntegratorWorkspace {
  std::vector<Real> x, p, dx, dp, sum_x, sum_p;
};

enum class IntegratorKind {
  explicit_euler,    ///< N1, order 1
  symplectic_euler,  ///< order 1, keeps energy bounded; one force evaluation: the default for effects
  midpoint,          ///< N3, RK2, order 2
  rk4,               ///< N4, order 4
};

/// Advances (x, p) from t to t + h in place.
class Integrator {
 public:
  virtual ~Integrator() = default;
  virtual void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
                    IntegratorWorkspace& work) const = 0;
};

/// The integrator of a kind; a shared immutable object.
const Integrator& integrator(IntegratorKind kind);

}  // namespace offstage::sim
