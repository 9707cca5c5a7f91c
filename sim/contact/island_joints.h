#pragma once
/// The joints of islands, as part of the problems of contacts and of impacts (physics A3, A4).

#include <optional>
#include <span>
#include <vector>

#include "sim/articulation/joint_limits.h"
#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_graph.h"
#include "sim/contact/contact_interval.h"
#include "sim/contact/contact_problem.h"

namespace offstage::sim {

/// Whether contacts or joints act in an island.
bool has_forces(const Island& island);

/// The joints of islands as part of a contact problem. Their bodies have the indices Body::row.
class IslandJoints {
 public:
  /// Whether springs are rows without bounds, or soft constraints.
  enum class Springs { rows, constraints };
  /// Collects the joints' constraints and rows for an interval.
  void collect(std::span<const Island* const> islands, const ContactInterval& interval, Springs springs);
  /// Collects the constraints and rows for a collision at the bodies' `start` states.
  void collect_for_collision(const Island& island, Real time, Real substep);
  /// Adds the impulses of a collision to the loads of the joints.
  void store_impact_impulses();
  JointProblem problem() { return {constraints_, bounded_, impulses_}; }
  /// Stores the joints' impulses after the solution; they are also the next initial guess.
  void store_impulses(Real duration);

  std::span<Articulation* const> articulations() const { return articulations_; }
  /// The fraction of the interval after which the impulses of an articulation act.
  Real acting_from(std::size_t articulation) const {
    const Articulation& a = *articulations_[articulation];
    return stops_[articulation].value_or(a.has_springs() ? a.kicks_act_from() : kMiddle);
  }
  /// Whether all impulses act evenly throughout the interval and in the same directions: there are no limits
  /// near, no springs, and no distance joints.
  bool act_throughout() const;
  /// Removes the parts of the velocities at the interval's end that violate the constraints of the time when
  /// a limit is reached: the joint forces that would have turned the velocities afterwards end with the
  /// motion. Articulations that reach no limit are not changed.
  void project(std::span<ContactBody> bodies, Real end) const;
  /// For each articulation, the end of its rows among bounded().
  std::span<const uint32_t> bounded_ends() const { return bounded_ends_; }
  std::span<const BoundedRow> bounded() const { return bounded_; }
  std::span<const BoundedOrigin> origins() const { return origins_; }

 private:
  static constexpr Real kMiddle = 0.5;

  template <class Place>
  void collect_constraints(const Island& island, Springs springs, Place&& place);
  void place(Articulation& a, const ContactInterval& interval);
  Wrench wrench(std::size_t bounded, Real impulse) const;

  std::vector<Articulation*> articulations_;
  std::vector<JointConstraint> constraints_;
  std::vector<BoundedRow> bounded_;
  std::vector<BoundedOrigin> origins_;
  std::vector<uint32_t> bounded_ends_;
  std::vector<std::optional<Real>>
      stops_;  // by articulation: fraction of the interval before a limit is reached
  std::vector<Vec6> impulses_;
};

}  // namespace offstage::sim
