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
  /// How springs are represented: as rows without bounds, or as soft constraints.
  enum class Springs { rows, constraints };
  /// Collects the joints' constraints and rows for an interval.
  void collect(std::span<const Island* const> islands, const ContactInterval& interval, Springs springs);
  /// Collects the constraints and rows for a collision at the bodies' `start` states.
  void collect_for_collision(const Island& island, Real time, Real substep);
  /// Adds the impulses of a collision to the loads of the joints.
  void store_impact_impulses();
  JointProblem problem() { return {constraints_, bounded_, impulses_}; }
  /// Stores the impulses of the solution in the joints: as loads, divided by `duration` [s], and as the next
  /// initial guess.
  void store_impulses(Real duration);

  std::span<Articulation* const> articulations() const { return articulations_; }
  /// Fraction of the interval after which the impulses of an articulation are applied, from 0 to 1.
  Real acting_from(std::size_t articulation) const {
    const Articulation& a = *articulations_[articulation];
    return stops_[articulation].value_or(a.has_springs() ? a.kicks_act_from() : kMiddle);
  }
  /// Whether all impulses act with constant force and direction throughout the interval. This requires that
  /// no limit is near, and that there are no springs and no distance joints.
  bool act_throughout() const;
  /// Removes, from the velocities at the interval's end, the components that violate the constraints at the
  /// time when a limit is reached. It changes only articulations that reach a limit.
  void project(std::span<ContactBody> bodies, Real end) const;
  /// For each articulation, the index in bounded() after its last row.
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
