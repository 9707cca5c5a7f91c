#pragma once
/// Integrators behind one seam (physics N1-N5). A system is described by two flat vectors: coordinates x and
/// rates p (velocities or momenta), with dx/dt = velocity(t, x, p) and dp/dt = force(t, x, p).

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/SparseCore>

#include "sim/core/types.h"

namespace offstage::sim {

/// Entries of a sparse matrix; those at the same place add up.
using SparseEntries = std::vector<Eigen::Triplet<Real>>;

/// The right-hand side of the equations of motion. Implementations must not keep state between calls.
class DynamicSystem {
 public:
  virtual ~DynamicSystem() = default;
  /// dx = dx/dt at time t; sizes: x and dx equal, p as the state's.
  virtual void velocity(Real t, std::span<const Real> x, std::span<const Real> p,
                        std::span<Real> dx) const = 0;
  /// dp = dp/dt at time t.
  virtual void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const = 0;
  /// The same, and in `damping` for each p the rate at which drag takes it away [1/s]: minus the derivative
  /// of dp by p, where that couples no two of them. False, and nothing is written: forces depend on p in
  /// other ways, or this is not known. Here false.
  virtual bool force_and_damping(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp,
                                 std::span<Real> damping) const;
  /// Appends the derivatives of (dx, dp) by (x, p), for implicit integration: row and column i are x_i, or
  /// p_(i - |x|). The places must not depend on the state. Small parts may be left out: the result is the
  /// same, found in more iterations. Here by differences, which suits small systems only.
  virtual void jacobian(Real t, std::span<const Real> x, std::span<const Real> p,
                        SparseEntries& entries) const;
};

/// What integration took.
struct IntegratorReport {
  uint64_t steps = 0;        ///< accepted; a fixed-step integrator makes one per call
  uint64_t rejected = 0;     ///< undone and tried again with a shorter step
  uint64_t evaluations = 0;  ///< of the forces
  uint64_t iterations = 0;   ///< Newton steps of an implicit integrator
  uint64_t missed = 0;       ///< steps of the shortest length, accepted though the error was above the target
                             ///< or the Newton iteration had not converged

  void add(const IntegratorReport& r) {
    steps += r.steps;
    rejected += r.rejected;
    evaluations += r.evaluations;
    iterations += r.iterations;
    missed += r.missed;
  }
};

/// What belongs to the caller of an integrator, and buffers; one per thread avoids allocation.
struct IntegratorWorkspace {
  /// Of the adaptive integrators: the greatest error of a coordinate by a step, in that coordinate's unit.
  Real tolerance = 1e-6;
  /// Of the adaptive integrators: the length that the next step may have [s]; 0: not known. Whoever
  /// integrates several systems with one workspace keeps it for each.
  Real next_step = 0;
  IntegratorReport report;  ///< summed over all calls

  std::vector<Real> x, p, dx, dp, damping, sum_x, sum_p;
  std::vector<Real> next_x, next_p, error_x, error_p;
  std::vector<std::vector<Real>> stages_x, stages_p;
};

enum class IntegratorKind {
  explicit_euler,    ///< N1, order 1
  symplectic_euler,  ///< order 1, keeps energy bounded; one force evaluation
  /// Order 2: forces act at the middle of the step (drift, kick, drift). Symplectic without drag; drag damps
  /// as 1 / (1 + z + z^2 / 2), z = h k / m, stable for any step. One evaluation of the forces where they
  /// depend on the rates by drag alone (DynamicSystem::force_and_damping), else two. The default for
  /// particles.
  leapfrog,
  midpoint,           ///< N3, RK2, order 2
  rk4,                ///< N4, order 4
  implicit_euler,     ///< N2, backward, order 1: stable for any stiffness, and damps what it cannot follow
  adaptive_euler,     ///< N5, step doubling
  adaptive_midpoint,  ///< N5, step doubling
  adaptive_rk4,       ///< N5, step doubling
  dormand_prince,     ///< N5, embedded pair of orders 5 and 4
};

/// What an acceleration a at the start of a step of length h comes to where drag takes the velocity away at
/// the rate k: v + end a at its end, v + mean a in its mean. To second order in h k, without overshoot for
/// any.
struct DampedKick {
  DampedKick(Real h, Real k) {
    const Real z = h * k, share = h / (1 + z + z * z / 2);
    end = share * (1 + z / 2);
    mean = share * (1 + z) / 2;
  }
  Real end, mean;
};

/// Advances (x, p) from t to t + h in place. The adaptive ones step inside by their own clock.
class Integrator {
 public:
  virtual ~Integrator() = default;
  virtual void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
                    IntegratorWorkspace& work) const = 0;
  /// The error of a motion falls as the step to this power.
  virtual int order() const = 0;
};

/// The integrator of a kind; a shared immutable object.
const Integrator& integrator(IntegratorKind kind);

}  // namespace offstage::sim
