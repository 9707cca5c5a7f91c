#pragma once
/// The joints of islands, as part of the problems of contacts and of impacts (physics A3, A4).

#include <span>
#include <vector>

#include "sim/articulation/joint_limits.h"
#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_graph.h"
#include "sim/contact/contact_interval.h"

namespace offstage::sim {

/// Whether contacts or joints act in an island.
bool has_forces(const Island& island);

/// The joints of islands as part of a contact problem. Their bodies have the indices Body::row.
class IslandJoints {
 public:
  /// Collects the joints' constraints and rows for an interval.
  void collect(std::span<const Island* const> islands, const ContactInterval& interval);
  /// Collects the constraints and rows for a collision at the bodies' `start` states.
  void collect_for_collision(const Island& island, Real time);
  /// Adds the impulses of a collision to the loads of the joints.
  void store_impact_impulses();
  JointProblem problem() { return {constraints_, bounded_, impulses_}; }
  /// Stores the joints' impulses after the solution; they are also the next initial guess.
  void store_impulses(Real duration);

  std::span<Articulation* const> articulations() const { return articulations_; }
  /// End of the bounded rows of each articulation.
  std::span<const uint32_t> bounded_ends() const { return bounded_ends_; }
  std::span<const BoundedRow> bounded() const { return bounded_; }
  std::span<const BoundedOrigin> origins() const { return origins_; }

 private:
  void collect_constraints(const Island& island, Real time, bool at_start);
  Wrench wrench(std::size_t bounded, Real impulse) const;

  std::vector<Articulation*> articulations_;
  std::vector<JointConstraint> constraints_;
  std::vector<BoundedRow> bounded_;
  std::vector<BoundedOrigin> origins_;
  std::vector<uint32_t> bounded_ends_;
  std::vector<Vec6> impulses_;
};

}  // namespace offstage::sim
