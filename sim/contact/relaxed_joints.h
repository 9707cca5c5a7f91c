#pragma once
/// Joints in the sub-steps of the fast solver: after the contacts' sweep, each articulation's constraints are
/// satisfied all at once by its sparse system, so that neither long chains nor great ratios of masses stretch
/// it; then its rows with bounds, one after the other, each by what its impulse does to the whole
/// articulation.

#include <span>
#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/articulation/joint_problem.h"
#include "sim/contact/patch_batch.h"

namespace offstage::sim {

struct RelaxedBody;

class RelaxedJoints {
 public:
  /// `constraints` and `bounded` hold those of the first articulation first, and so on; of its `bounded` the
  /// i-th articulation ends at `bounded_ends[i]`.
  RelaxedJoints(const JointProblem& problem, std::span<Articulation* const> articulations,
                std::span<const uint32_t> bounded_ends);

  /// How many parts solve() has, which share no body.
  uint32_t count() const { return static_cast<uint32_t>(parts_.size()); }

  void begin(std::span<const RelaxedBody> bodies, Real duration, uint32_t substeps);
  /// The first sub-step begins: what acted before goes on.
  void start(uint32_t part, std::span<BodyMotion> motions);
  /// At the end of a sub-step that is `elapsed` after the start.
  void solve(uint32_t part, std::span<BodyMotion> motions, Real elapsed, bool is_last);
  /// Writes the impulses of the whole step.
  void finish();

 private:
  struct Row {
    Real inverse_stiffness;      // by how much a unit of impulse changes u, softness included
    Real impulse, lower, upper;  // of a sub-step
    Real softness, sum = 0;      // for that; of the whole step
    std::vector<Vec6> response;  // of the links; none: of its own two, in `response_a` and `response_b`
    std::vector<Vec6> reaction;  // of the joints to that, likewise
    Vec6 response_a, response_b;
  };
  struct Part {
    Articulation* articulation;
    uint32_t first_constraint, first_row, last_row;
    std::vector<uint32_t> bodies;  // of the links
    std::vector<Vec6> velocities, change, impulses;
    std::vector<Vec6> now, sum;  // impulses of the joints in this sub-step, and in the whole step
  };

  void prepare(Part& part, std::span<const RelaxedBody> bodies);
  void prepare_row(Part& part, uint32_t i, std::span<const RelaxedBody> bodies);
  void push(Part& part, uint32_t i, Real impulse, std::span<BodyMotion> motions) const;

  JointProblem problem_;
  std::vector<Part> parts_;
  std::vector<Row> rows_;
  std::span<const RelaxedBody> bodies_;
  Real substep_ = 0, duration_ = 0;
};

}  // namespace offstage::sim
