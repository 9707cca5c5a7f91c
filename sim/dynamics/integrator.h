#pragma once
/// Common interface of the integrators (physics N1-N5). A system is described by two flat vectors:
/// coordinates x and rates p (velocities or momenta), with dx/dt = velocity(t, x, p) and dp/dt = force(t, x,
/// p).

#include <cstdint>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include <Eigen/SparseCore>

#include "sim/core/figures.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// Entries of a sparse matrix; entries with the same row and column are added.
using SparseEntries = std::vector<Eigen::Triplet<Real>>;

/// The right-hand side of the equations of motion. Implementations must not keep state between calls.
class DynamicSystem {
 public:
  virtual ~DynamicSystem() = default;
  /// Computes dx = dx/dt at time t. x and dx have the same size; p has the size of the state's rates.
  virtual void velocity(Real t, std::span<const Real> x, std::span<const Real> p,
                        std::span<Real> dx) const = 0;
  /// Computes dp = dp/dt at time t.
  virtual void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const = 0;
  /// Computes dp as force() does and, in `damping`, the rate at which drag reduces each element of p [1/s]:
  /// minus the derivative of dp with respect to p, if this is diagonal. Returns false and writes nothing if
  /// forces depend on p in other ways, or if this is unknown. The default returns false.
  virtual bool force_and_damping(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp,
                                 std::span<Real> damping) const;
  /// Appends the derivatives of (dx, dp) by (x, p), for implicit integration. Row and column i stand for x_i,
  /// or for p_(i - |x|). The sparsity pattern must not depend on the state. Small entries may be omitted: the
  /// result is the same, but takes more iterations. The default uses finite differences, which suits only
  /// small systems.
  virtual void jacobian(Real t, std::span<const Real> x, std::span<const Real> p,
                        SparseEntries& entries) const;
};

/// Statistics of an integration.
struct IntegratorReport {
  uint64_t steps = 0;        ///< accepted steps; a fixed-step integrator makes one per call
  uint64_t rejected = 0;     ///< steps undone and repeated with a shorter length
  uint64_t evaluations = 0;  ///< evaluations of the forces
  uint64_t iterations = 0;   ///< Newton steps of an implicit integrator
  /// Steps of the shortest length that were accepted although the error was above the target or the Newton
  /// iteration had not converged.
  uint64_t missed = 0;

  static constexpr auto figures() {
    using T = IntegratorReport;
    return std::tuple(Figure("steps", &T::steps), Figure("rejected", &T::rejected),
                      Figure("evaluations", &T::evaluations), Figure("iterations", &T::iterations),
                      Figure("missed", &T::missed));
  }
  void add(const IntegratorReport& more) { add_figures(*this, more); }
};

/// Settings, state and buffers of an integrator that the caller keeps between calls. Use one per thread.
struct IntegratorWorkspace {
  /// Adaptive integrators: greatest error of a coordinate in a step, in the unit of that coordinate.
  Real tolerance = 1e-6;
  /// Adaptive integrators: length of the next step [s]; 0: unknown. A caller that integrates several systems
  /// with one workspace stores it for each of them.
  Real next_step = 0;
  IntegratorReport report;  ///< sums over all calls

  std::vector<Real> x, p, dx, dp, damping, sum_x, sum_p;
  std::vector<Real> next_x, next_p, error_x, error_p;
  std::vector<std::vector<Real>> stages_x, stages_p;
};

enum class IntegratorKind {
  explicit_euler,    ///< N1, order 1
  symplectic_euler,  ///< order 1, energy stays bounded; one evaluation of the forces
  /// Order 2: drift, kick, drift; forces are evaluated at the middle of the step. Symplectic without drag.
  /// Drag damps by the factor 1 / (1 + z + z^2 / 2), z = h k / m, which is stable for any step. One
  /// evaluation of the forces if they depend on the rates only by drag (DynamicSystem::force_and_damping),
  /// otherwise two. The default for particles.
  leapfrog,
  midpoint,  ///< N3, RK2, order 2
  rk4,       ///< N4, order 4
  /// N2, backward, order 1: stable for any stiffness; damps motions that are faster than the step.
  implicit_euler,
  adaptive_euler,     ///< N5, step doubling
  adaptive_midpoint,  ///< N5, step doubling
  adaptive_rk4,       ///< N5, step doubling
  dormand_prince,     ///< N5, embedded pair of orders 5 and 4
};

/// Effect of a constant acceleration a over a step of length h [s], with drag of the rate k [1/s]. The change
/// of velocity is `end` * a at the end of the step, and `mean` * a on average over the step. It is accurate
/// to second order in h k, and never overshoots.
struct DampedKick {
  DampedKick(Real h, Real k) {
    const Real z = h * k, fraction = h / (1 + z + z * z / 2);
    end = fraction * (1 + z / 2);
    mean = fraction * (1 + z) / 2;
  }
  Real end, mean;
};

/// Advances (x, p) from t to t + h in place. Adaptive integrators divide this time into steps of their own.
class Integrator {
 public:
  virtual ~Integrator() = default;
  virtual void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
                    IntegratorWorkspace& work) const = 0;
  /// Order of convergence n: the error after a given time is proportional to (length of the step)^n.
  virtual int order() const = 0;
};

/// Returns the integrator of a kind. It is a shared, immutable object.
const Integrator& integrator(IntegratorKind kind);

}  // namespace offstage::sim
