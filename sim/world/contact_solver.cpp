#include "sim/world/contact_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <oneapi/tbb/parallel_for.h>

#include "sim/articulation/joint_energy.h"
#include "sim/contact/energy_guard.h"
#include "sim/contact/sprung_paths.h"
#include "sim/world/joint_groups.h"

namespace offstage::sim {
namespace {

/// Fraction of the kinetic energy of an island with joints that a sub-step may add. A greater excess is
/// removed; it counts as a fall-back if it is larger than the usual error of the velocity terms. At rest the
/// kinetic energy is rounding, and the energy of a fall through the interval takes its place.
constexpr Real kAddedByJoints = 1e-3, kUsualExcess = 0.02;
/// The sweeps of the fast solver pass on a load to a light body in steps of about this body's own weight:
/// with 32 sweeps in 1/60 s, stacks of two boxes hold if the upper one has at most about 300 times the mass.
/// An island is uneven if its heaviest body, or the links of an articulation together, have more than kUneven
/// times the mass of a body that is squeezed.
constexpr Real kUneven = 100;

/// Whether a heavy body, or the links of an articulation together, may press a light body against others, in
/// an island small enough for the exact solver.
bool is_uneven(const Island& island) {
  if (island.bodies.size() > kFewBodies || island.pairs.size() < 2) return false;
  Real heaviest = 0;
  for (const Body* body : island.bodies) heaviest = std::max(heaviest, body->rigid.mass);
  const auto presses = [&](const Articulation* articulation, const Body* light) {
    const std::span<Body* const> links = articulation->bodies();
    Real mass = 0;
    for (const Body* link : links) mass += link->rigid.mass;
    return mass > kUneven * light->rigid.mass && std::ranges::find(links, light) == links.end();
  };
  return std::ranges::any_of(island.bodies, [&](const Body* body) {
    const bool is_light = heaviest > kUneven * body->rigid.mass ||
                          std::ranges::any_of(island.articulations, [&](const Articulation* articulation) {
                            return presses(articulation, body);
                          });
    return is_light && std::ranges::count_if(island.pairs, [&](const ContactPair* pair) {
                         return &pair->a() == body || &pair->b() == body;
                       }) > 1;
  });
}

/// Returns the potential energy of an island by gravity [J].
Real height_energy(const Island& island, const Vec3& gravity) {
  Real sum = 0;
  for (const Body* body : island.bodies) sum -= body->rigid.mass * gravity.dot(body->rigid.position);
  return sum;
}

/// Upper bound of an island's kinetic energy after its contacts are solved, its potential energy before, and
/// the kinetic energy that gravity gives to free bodies from rest in the interval [J].
struct EnergyBound {
  Real kinetic, height, fall;
};

/// Projects the bodies onto the joints, because contacts and limits move them so that the joints are
/// satisfied only approximately. If links turn far in a step, the kinetic energy may then exceed its bound;
/// in this case the relative velocities of the links are reduced. Where contacts and limits lead to a lower
/// position than the free motion, gravity has done more work: a pendulum that rebounds from a limit falls
/// while the free one would still rise.
JointFigures settle_joints(const Island& island, Real end, const EnergyBound& bound, const Vec3& gravity) {
  JointFigures tally;
  for (Articulation* articulation : island.articulations) {
    articulation->settle(end, tally);
    for (Body* body : articulation->bodies()) body->pose = body->rigid.pose();
  }
  if (std::isinf(bound.kinetic)) return tally;
  const Real most_energy = bound.kinetic + std::max(0.0, bound.height - height_energy(island, gravity));
  if (const Real excess = kinetic_energy(island) - most_energy; excess > 0) {
    Real internal = 0;
    for (const Articulation* a : island.articulations) internal += internal_energy(*a);
    for (const Articulation* a : island.articulations)
      slow_down(*a, std::sqrt(std::max(0.0, 1 - excess / internal)));
    tally.unsolved += excess > kUsualExcess * (most_energy + bound.fall);
  }
  return tally;
}

/// Returns the bound of an island's energy before its contacts are solved. Contacts and joints dissipate
/// energy, except for the error of their velocity terms.
EnergyBound energy_bound(const Island& island, const ContactInterval& interval, const Vec3& gravity) {
  if (island.articulations.empty() || can_do_work(island))
    return {std::numeric_limits<Real>::infinity(), 0, 0};
  const Real added = kAddedByJoints * interval.duration / interval.substep;
  Real mass = 0;
  for (const Body* body : island.bodies) mass += body->rigid.mass;
  return {(1 + added) * kinetic_energy(island), height_energy(island, gravity),
          mass * (interval.duration * gravity).squaredNorm() / 2};
}

}  // namespace

void ContactSolver::solve_all(std::span<Island> islands, Real start, Real h, StepReport& report) {
  cost_ = 0;
  std::vector<Island*> all;
  for (Island& island : islands)
    if (has_forces(island)) all.push_back(&island);
  // Impacts may still merge islands to uneven ones, so the fast solver's budget begins without them, too.
  std::vector<Island*> uneven;
  if (world_.def.solver == SolverKind::fast)
    std::ranges::copy_if(all, std::back_inserter(uneven),
                         [](const Island* island) { return is_uneven(*island); });
  if (!world_.is_exact()) patience_.begin(world_.def.solver == SolverKind::fast ? uneven : all, h);
  solve(all,
        {.duration = h,
         .end = start + h,
         .substep = h,
         .impact_speed = world_.def.collision_speed,
         .is_whole = true},
        report);
}

void ContactSolver::solve(Island& island, const ContactInterval& interval, StepReport& report) {
  Island* const one[] = {&island};
  if (has_forces(island)) solve(one, interval, report);
}

void ContactSolver::solve(std::span<Island* const> group, const ContactInterval& interval,
                          StepReport& report) {
  SprungPaths sprung(group, interval.duration);
  std::vector<const Island*> fast;
  std::vector<std::pair<Island*, SolverChoice*>> exact;
  for (Island* island : group) {
    if (world_.def.solver == SolverKind::fast && !is_uneven(*island)) {
      fast.push_back(island);
      continue;
    }
    SolverChoice& choice = choices_[island->bodies.front()->handle.index];
    if (!world_.is_exact() &&
        (interval.is_cheap || !choice.should_try_exact(*island, patience_, interval.is_whole))) {
      fast.push_back(island);
      continue;
    }
    if (!choice.exact) choice.exact = std::make_unique<ExactContacts>();
    exact.emplace_back(island, &choice);
  }
  const Vec3& gravity = world_.def.gravity;
  std::vector<EnergyBound> bounds;
  for (const Island* island : group) bounds.push_back(energy_bound(*island, interval, gravity));
  std::vector<ExactContacts::Outcome> outcomes(exact.size());
  using Method = ExactContacts::Method;
  const Method method = world_.def.solver == SolverKind::lcp ? Method::lcp : Method::proximal;
  std::vector<Real> budgets(exact.size(), kInfinity);
  if (!world_.is_exact()) {
    for (std::size_t i = 0; i < exact.size(); ++i)
      budgets[i] = exact[i].second->budget(*exact[i].first, interval.duration, patience_);
    patience_.share(budgets);
  }
  const auto run = [&](std::size_t i) {
    const auto& [island, choice] = exact[i];
    outcomes[i] = choice->exact->solve(*island, interval, budgets[i], method);
  };
  if (exact.size() < 2) {
    for (std::size_t i = 0; i < exact.size(); ++i) run(i);
  } else {
    tbb::parallel_for(std::size_t{0}, exact.size(), run);
  }
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const auto& [island, choice] = exact[i];
    const ExactContacts::Outcome& outcome = outcomes[i];
    report.solvers.exact.add(outcome.work);
    report.solvers.lcp.add(outcome.lcp);
    record_rough_contact(outcome.rough, report);
    cost_ += choice->exact->cost() + choice->exact->division_cost();
    choice->record_attempt(*island, interval.duration, outcome.is_applied, patience_);
    if (outcome.is_applied) continue;
    report.solvers.exact.over_budget += outcome.work.fallbacks == 0;
    fast.push_back(island);
  }
  for (const Island* island : fast) cost_ += fast_cost(*island, interval.duration);
  if (!fast.empty()) report.solvers.fast.add(fast_.solve(fast, interval));
  sprung.keep_on_contacts();
  for (std::size_t i = 0; i < group.size(); ++i)
    if (!group[i]->articulations.empty())
      report.joints.add(settle_joints(*group[i], interval.end, bounds[i], gravity));
}

void record_rough_contact(const ContactPair* pair, StepReport& report) {
  if (pair) report.rough_contacts.push_back({pair->a().handle, pair->b().handle});
}

}  // namespace offstage::sim
