#pragma once
/// Whether an island is for the exact or the fast solver.

#include <memory>
#include <span>

#include "sim/contact/contact_graph.h"
#include "sim/contact/exact_contacts.h"

namespace offstage::sim {

/// What the exact solver may take beyond the fast one, over all islands of a world: in a heap that comes down
/// there is a new island in every sub-step, each of which would be dear.
class ExactSolverBudget {
 public:
  /// A sub-step with these islands begins.
  void begin(std::span<Island* const> islands, Real duration);
  /// An attempt on an island took so much more than it is worth [ns].
  void spend(Real cost) { debt_ += cost; }
  /// How much of the credit is left, from 0 to 1.
  Real left() const { return left_; }
  /// Whether the world is so small that no solver takes long.
  bool is_small() const { return small_; }

 private:
  Real debt_ = 0, left_ = 1;
  bool small_ = true;
};

/// Whether an island is for the exact or the fast solver, by what the exact one cost on islands like it
/// before. Costs are counted work times what the operations take on a machine of 2020 [ns], so that the
/// choice is the same in every run.
class SolverChoice {
 public:
  /// Whether to try the exact solver now.
  bool is_exact_worth(const Island& island, const ExactSolverBudget& patience);
  /// What the attempt may cost, so that all attempts together take but a share of what the fast solver takes.
  Real budget(const Island& island, Real duration, const ExactSolverBudget& patience) const;
  /// What became of the attempt.
  void learn(const Island& island, Real duration, bool solved, ExactSolverBudget& patience);

  std::unique_ptr<ExactContacts> exact;

 private:
  uint32_t wait_ = 0;    // sub-steps until the next attempt
  Real debt_ = 0;        // [ns]
  bool proven_ = false;  // the last attempt was cheap
};

}  // namespace offstage::sim
