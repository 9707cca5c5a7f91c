/// Chooses the exact or the fast solver for an island.

#include "sim/contact/solver_choice.h"

#include <algorithm>

namespace offstage::sim {
namespace {

/// If the fast solution of the whole world takes less than this [ns], islands of at most kFewBodies bodies
/// always use the exact solver.
constexpr Real kSmall = 1e5;
/// Cost of the fast solver per point and sub-step [ns].
constexpr Real kFastPoint = 60;
/// Cost of the fast solver per joint and sub-step [ns].
constexpr Real kFastJoint = 200;
/// kWorth: how many times the cost of the fast solver the exact solver may have on average. Any further cost
/// is a debt, of at most kCredit steps of the fast solver. The exact solver is expensive for a new island,
/// and cheap afterwards.
constexpr Real kWorth = 2.5, kCredit = 120;
/// After the credit is exceeded, the exact solver is not tried while the debt decreases: in each step by the
/// fraction kFraction of the fast solver's cost, for at most kLongestWait steps.
constexpr Real kFraction = 0.25, kLongestWait = 2400;
/// With less than this fraction of the credit left, only islands whose last attempt was cheap are tried.
constexpr Real kLittle = 0.05;
/// Greatest cost of an attempt: in a small world [ns], and as a multiple of the fast solver's cost if bodies
/// move. If no body is faster than kQuiet [m/s], an attempt may use the whole credit, because the island will
/// stay at rest and the following solutions are cheap.
constexpr Real kMostOfFew = 2e6, kMostOfMoving = 3, kQuiet = 0.1;

/// Greatest cost of all attempts of a sub-step [ns], in a small world [ns], and as a multiple of the fast
/// solver's cost. The first sub-step of a world may use the whole credit: no forces are known yet, and a
/// scene that starts at rest stays at rest.
constexpr Real kMostOfSubstep = 1e6, kMostOfSmallSubstep = 3e6, kMostOfLargeSubstep = 3;

bool is_quiet(const Island& island) {
  return std::all_of(island.bodies.begin(), island.bodies.end(), [](const Body* body) {
    return body->start_twist.velocity.norm() + body->turning_speed() < kQuiet;
  });
}

}  // namespace

Real fast_cost(const Island& island, Real duration) {
  Real points = 0;
  for (const ContactPair* pair : island.pairs)
    for (const PlacedManifold& m : pair->manifolds()) points += m.manifold.count;
  Real joints = 0;
  for (const Articulation* a : island.articulations) joints += static_cast<Real>(a->joints().size());
  return (points * kFastPoint + joints * kFastJoint) * relaxation_substeps(duration);
}

void ExactSolverBudget::begin(std::span<Island* const> islands, Real duration) {
  Real fast = 0;
  for (const Island* island : islands) fast += fast_cost(*island, duration);
  small_ = fast < kSmall;
  debt_ = std::max(0.0, debt_ - kFraction * fast);
  left_ = std::max(0.0, 1 - debt_ / (kCredit * std::max(fast, kSmall)));
  substep_left_ = is_first_ ? kInfinity
                  : small_  ? kMostOfSmallSubstep
                            : std::max(kMostOfSubstep, kMostOfLargeSubstep * fast);
  is_first_ = is_first_ && islands.empty();
}

void ExactSolverBudget::share(std::span<Real> budgets) const {
  Real sum = 0;
  for (const Real budget : budgets) sum += budget;
  if (sum <= substep_left_) return;
  for (Real& budget : budgets) budget *= substep_left_ / sum;
}

bool SolverChoice::should_try_exact(const Island& island, const ExactSolverBudget& shared, bool is_whole) {
  if (!shared.has_left_in_substep()) return false;
  if (shared.is_small() && island.bodies.size() <= kFewBodies) return true;
  if (wait_ == 0)
    return proven_ || (shared.left() > kLittle && (is_whole || island.bodies.size() <= kFewBodies));
  --wait_;
  return false;
}

Real SolverChoice::budget(const Island& island, Real duration, const ExactSolverBudget& shared) const {
  if (shared.is_small() && island.bodies.size() <= kFewBodies) return kMostOfFew;
  const Real fast = fast_cost(island, duration), credit = kCredit * fast * (proven_ ? 1 : shared.left());
  return is_quiet(island) ? credit : std::min(credit, kMostOfMoving * std::max(fast, kSmall));
}

void SolverChoice::record_attempt(const Island& island, Real duration, bool solved,
                                  ExactSolverBudget& shared) {
  const Real fast = fast_cost(island, duration), excess = exact->cost() - kWorth * fast;
  const bool always = shared.is_small() && island.bodies.size() <= kFewBodies;
  shared.spend(exact->cost() + exact->division_cost(), always ? 0 : excess);
  if (always) return;
  proven_ = solved && excess <= 0;
  debt_ = std::max(0.0, debt_ + excess);
  if (solved && debt_ <= kCredit * fast) return;
  wait_ = static_cast<uint32_t>(std::clamp(debt_ / (kFraction * fast), 1.0, kLongestWait));
  debt_ = 0;
}

}  // namespace offstage::sim
