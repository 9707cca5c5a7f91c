#pragma once
/// Choice of the exact or the fast solver for an island.

#include <algorithm>
#include <memory>
#include <span>

#include "sim/contact/contact_graph.h"
#include "sim/contact/exact_contacts.h"

namespace offstage::sim {

/// Up to this number of bodies, every solver is cheap. Small islands always use the exact solver, and small
/// worlds resolve each collision at its own time.
inline constexpr std::size_t kFewBodies = 6;

/// Budget of the exact solver for all islands of a world: on average, and in a single sub-step. A collapsing
/// heap creates new islands in every sub-step, and each would be expensive.
class ExactSolverBudget {
 public:
  /// Begins a sub-step with these islands.
  void begin(std::span<Island* const> islands, Real duration);
  /// Reduces the budgets of attempts that are made together [ns], so that their sum is at most what is left
  /// for this sub-step.
  void share(std::span<Real> budgets) const;
  /// Records the cost of an attempt on an island, and how much of it exceeds the cost that the exact solver
  /// may have on average [ns].
  void spend(Real cost, Real excess) {
    substep_left_ = std::max(0.0, substep_left_ - cost);
    debt_ += excess;
  }
  /// Whether further attempts in this sub-step are within the budget.
  bool has_left_in_substep() const { return substep_left_ > 0; }
  /// Remaining fraction of the budget, from 0 to 1.
  Real left() const { return left_; }
  /// Whether the world is so small that every solver is fast.
  bool is_small() const { return small_; }

 private:
  Real debt_ = 0, left_ = 1;
  Real substep_left_ = 0;  // greatest cost of further attempts in this sub-step [ns]
  bool small_ = true;
  bool is_first_ = true;  // whether there were no contacts before the current sub-step
};

/// Returns the cost of the fast solver for an island over an interval of this duration [ns].
Real fast_cost(const Island& island, Real duration);

/// Chooses the exact or the fast solver for an island, based on the cost of previous attempts with the exact
/// solver. Costs [ns] are estimated from the number of operations and typical times per operation on a
/// computer of 2020, so that the choice is deterministic.
class SolverChoice {
 public:
  /// Returns whether to try the exact solver. In an interval that is not a whole sub-step, a large island is
  /// tried only if the last attempt was cheap.
  bool should_try_exact(const Island& island, const ExactSolverBudget& shared, bool is_whole);
  /// Greatest allowed cost of the attempt [ns]. It keeps the cost of all attempts below a fraction of the
  /// fast solver's cost.
  Real budget(const Island& island, Real duration, const ExactSolverBudget& shared) const;
  /// Records the result of the attempt.
  void record_attempt(const Island& island, Real duration, bool solved, ExactSolverBudget& shared);

  std::unique_ptr<ExactContacts> exact;

 private:
  uint32_t wait_ = 0;    // sub-steps until the next attempt
  Real debt_ = 0;        // [ns]
  bool proven_ = false;  // the last attempt was cheap
};

}  // namespace offstage::sim
