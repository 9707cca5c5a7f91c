#pragma once
/// Contact forces of islands (physics R7-R10). For each island the exact or the fast solver is chosen.

#include <map>
#include <span>

#include "sim/contact/contact_interval.h"
#include "sim/contact/fast_contacts.h"
#include "sim/contact/solver_choice.h"
#include "sim/world/world_state.h"

namespace offstage::sim {

class ContactSolver {
 public:
  explicit ContactSolver(const WorldState& world) : world_(world) {}

  /// Solves all islands over a whole sub-step, which begins at time `start` and has length h [s].
  void solve_all(std::span<Island> islands, Real start, Real h, StepReport& report);
  /// Solves some islands over an interval within a sub-step.
  void solve(std::span<Island* const> group, const ContactInterval& interval, StepReport& report);
  /// Solves one island over an interval, if any forces can act in it.
  void solve(Island& island, const ContactInterval& interval, StepReport& report);
  /// Cost of all solutions since the start of the sub-step, estimated from the number of operations [ns].
  Real cost() const { return cost_; }

 private:
  const WorldState& world_;
  std::map<uint32_t, SolverChoice> choices_;  // by the slot of an island's first body
  ExactSolverBudget patience_;
  FastContacts fast_;
  Real cost_ = 0;
};

/// Adds a pair with inaccurate contact forces to StepReport::rough_contacts. Does nothing for null.
void record_rough_contact(const ContactPair* pair, StepReport& report);

}  // namespace offstage::sim
