#pragma once
/// The joints of islands, as part of the problems of contacts and of impacts (physics A3, A4).

#include <span>
#include <vector>

#include "sim/articulation/joint_limits.h"
#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_graph.h"
#include "sim/contact/contact_interval.h"

namespace offstage::sim {

/// Whether anything but free motion happens in an island.
bool has_forces(const Island& island);

/// The joints of islands as part of a problem: their bodies have the indices Body::row.
class IslandJoints {
 public:
  /// For an interval.
  void collect(std::span<const Island* const> islands, const ContactInterval& interval);
  /// For a collision at the bodies' start.
  void collect_for_collision(const Island& island, Real time);
  /// After a collision: adds its impulses to the loads of the joints.
  void store_impact_impulses();
  JointProblem problem() { return {constraints_, bounded_, impulses_}; }
  /// After the solution: stores the forces of the joints, which are also the next guess.
  void store_impulses(Real duration);

  std::span<Articulation* const> articulations() const { return articulations_; }
  /// Where the rows with bounds of each articulation end.
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
