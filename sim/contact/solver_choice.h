#pragma once
/// Choice of the exact or the fast solver for an island.

#include <memory>
#include <span>

#include "sim/contact/contact_graph.h"
#include "sim/contact/exact_contacts.h"

namespace offstage::sim {

/// Up to this number of bodies, every solver is cheap. Small islands always use the exact solver, and small
/// worlds resolve each collision at its own time.
inline constexpr std::size_t kFewBodies = 6;

/// Budget of the exact solver beyond the cost of the fast one, for all islands of a world. A collapsing heap
/// creates new islands in every sub-step, and each would be expensive.
class ExactSolverBudget {
 public:
  /// Begins a sub-step with these islands.
  void begin(std::span<Island* const> islands, Real duration);
  /// Records the excess cost of an attempt on an island [ns].
  void spend(Real cost) { debt_ += cost; }
  /// Remaining fraction of the budget, from 0 to 1.
  Real left() const { return left_; }
  /// Whether the world is so small that every solver is fast.
  bool is_small() const { return small_; }

 private:
  Real debt_ = 0, left_ = 1;
  bool small_ = true;
};

/// Chooses the exact or the fast solver for an island, based on the cost of previous attempts with the exact
/// solver. Costs [ns] are estimated from the number of operations and typical times per operation on a
/// computer of 2020, so that the choice is deterministic.
class SolverChoice {
 public:
  /// Returns whether to try the exact solver in this sub-step.
  bool should_try_exact(const Island& island, const ExactSolverBudget& shared);
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
