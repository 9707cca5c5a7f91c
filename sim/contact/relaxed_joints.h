#pragma once
/// Joints in the sub-steps of the fast solver. After the contacts' sweep, the sparse system of each
/// articulation satisfies all its constraints at once, so neither long chains nor large mass ratios stretch
/// it. Springs take part in it as soft constraints. Rows with bounds are then solved one after the other,
/// each using the response of the whole articulation to its impulse.

#include <span>
#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/articulation/joint_problem.h"
#include "sim/contact/patch_batch.h"

namespace offstage::sim {

struct RelaxedBody;

/// A contact point of a link. The contacts' sweeps see the mass of the link alone, so that a light link would
/// be pushed into an obstacle by the heavy bodies that it carries. A point that still approaches after the
/// joints were solved is stopped by an impulse on the whole articulation.
struct LinkContact {
  uint32_t part;          ///< index of the articulation
  uint32_t patch, point;  ///< indices of the contact
  BoundedRow row;         ///< the normal velocity; out: its impulse in the whole step
  Real separation;        ///< separation at the start of the step [m]
};

class RelaxedJoints {
 public:
  /// `constraints` and `bounded` of the problem are ordered by articulation; the bounded rows of the i-th
  /// articulation end at `bounded_ends[i]`. `contacts` are ordered by part.
  RelaxedJoints(const JointProblem& problem, std::span<Articulation* const> articulations,
                std::span<const uint32_t> bounded_ends, std::span<LinkContact> contacts);

  /// Number of parts of solve(). They are solved in order, since contacts connect them to other bodies.
  uint32_t count() const { return static_cast<uint32_t>(parts_.size()); }

  void begin(std::span<const RelaxedBody> bodies, Real duration, uint32_t substeps);
  /// Begins the first sub-step with the impulses of the last step.
  void start(uint32_t part, std::span<BodyMotion> motions);
  /// Solves a part at the end of a sub-step, `elapsed` after the start.
  void solve(uint32_t part, std::span<BodyMotion> motions, Real elapsed, bool is_last);
  /// Stores the displacements of the links. To be called before overlaps are removed by moving bodies.
  void begin_push(uint32_t part, std::span<const BodyMotion> motions);
  /// Moves the links of a part so that the displacements since begin_push() agree with the joints. Returns
  /// the greatest one [m]. Without this, joints would pull bodies back into the overlap at the end of each
  /// step.
  Real push_out(uint32_t part, std::span<BodyMotion> motions);
  /// The links' bodies of a part.
  std::span<const uint32_t> bodies(uint32_t part) const { return parts_[part].bodies; }
  /// Adds the effect of the joints in the step to the bodies, in double precision. `late` is, by body, the
  /// time by which the displacement by the sub-steps is too large per change of velocity [s].
  void add_motion(std::span<RelaxedBody> bodies, std::span<const Real> late) const;
  /// Writes the impulses of the whole step to the problem and the contacts.
  void finish();

 private:
  struct Row {
    Real inverse_stiffness;      // change of u per unit impulse, softness included
    Real impulse, lower, upper;  // bounds and impulse of a sub-step
    Real softness, sum = 0;      // softness; impulse of the whole step
    Real shift = 0;              // integral of the sum over the step
    bool acts = false;           // whether the time from which it acts has come
    bool is_ready = false;       // whether its responses are known
    // Of the links to a unit impulse; empty: only of its own two links, in `response_a` and `response_b`.
    std::vector<Vec6> response;
    std::vector<Vec6> reaction;  // of the joints to a unit impulse
    Vec6 response_a, response_b;
  };
  struct Part {
    Articulation* articulation;
    uint32_t first_constraint, first_row, last_row;
    uint32_t first_contact = 0, last_contact = 0;
    std::size_t prepared = 0;      // number of contacts with a known response
    std::vector<uint32_t> bodies;  // indices of the links' bodies
    std::vector<Vec6> velocities, change, impulses;
    std::vector<FloatLanes> before_push;  // by link: its displacement
    std::vector<Vec6> pushed;             // by link: its displacement since then
    // Impulses of the joints in this sub-step, in the whole step, and the integral of these over the step.
    std::vector<Vec6> now, sum, shift;
  };

  void prepare(Part& part, std::span<const RelaxedBody> bodies);
  void prepare_row(Part& part, const BoundedRow& r, Row& row, std::span<const RelaxedBody> bodies,
                   bool whole);
  void soften(Part& part, Real elapsed);
  void push(Part& part, const BoundedRow& r, const Row& row, Real impulse,
            std::span<BodyMotion> motions) const;
  void solve_contacts(Part& part, std::span<BodyMotion> motions, Real elapsed, bool is_last);
  Real speed(const BoundedRow& r, std::span<const BodyMotion> motions) const;

  JointProblem problem_;
  std::span<LinkContact> contacts_;
  std::vector<Part> parts_;
  std::vector<Row> rows_, contact_rows_;
  std::span<const RelaxedBody> bodies_;
  Real substep_ = 0, duration_ = 0;
};

}  // namespace offstage::sim
