#pragma once
/// Joints in the sub-steps of the fast solver. After the sweep over the contacts, one sparse linear system
/// per articulation satisfies all its constraints at once, so that long chains and large mass ratios do not
/// stretch joints. Springs are soft constraints of this system. Rows with bounds are then solved one after
/// the other; the effect of each impulse on the whole articulation is taken into account.

#include <span>
#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/articulation/joint_problem.h"
#include "sim/contact/patch_batch.h"

namespace offstage::sim {

struct RelaxedBody;

/// A contact point of a link that is solved with the joints. The sweeps over the contacts use only the mass
/// of the link itself, so heavy bodies that a light link supports would push it into an obstacle. If the
/// point still approaches after the joints were solved, an impulse on the whole articulation stops it.
struct LinkContact {
  uint32_t part;          ///< index of the articulation
  uint32_t patch, point;  ///< indices of the contact
  BoundedRow row;         ///< row for the normal velocity; out: impulse over the whole step
  Real separation;        ///< separation at the start of the step [m]
};

class RelaxedJoints {
 public:
  /// `constraints` and `bounded` of the problem are ordered by articulation; the bounded rows of the i-th
  /// articulation end at `bounded_ends[i]`. `contacts` are ordered by part.
  RelaxedJoints(const JointProblem& problem, std::span<Articulation* const> articulations,
                std::span<const uint32_t> bounded_ends, std::span<LinkContact> contacts);

  /// Number of parts, one per articulation. Parts must be solved in order, because contacts may connect them.
  uint32_t count() const { return static_cast<uint32_t>(parts_.size()); }

  void begin(std::span<const RelaxedBody> bodies, Real duration, uint32_t substeps);
  /// Applies the impulses of the last step as the initial guess, before the first sub-step.
  void start(uint32_t part, std::span<BodyMotion> motions);
  /// Solves a part at the end of a sub-step. `elapsed`: time since the start of the step [s].
  void solve(uint32_t part, std::span<BodyMotion> motions, Real elapsed, bool is_last);
  /// Stores the displacements of the links. Call it before overlaps are removed by moving bodies.
  void begin_push(uint32_t part, std::span<const BodyMotion> motions);
  /// Moves the links of a part so that their displacements since begin_push() satisfy the joints. Otherwise
  /// the joints would pull bodies back into the overlap at the end of each step. Returns the greatest
  /// displacement of this call [m].
  Real push_out(uint32_t part, std::span<BodyMotion> motions);
  /// Indices of the bodies of a part.
  std::span<const uint32_t> bodies(uint32_t part) const { return parts_[part].bodies; }
  /// Adds the effect of the joints in the step to the bodies, in double precision. `late`: by body, the
  /// excess displacement by the sub-steps divided by the change of velocity [s]; this function removes the
  /// excess.
  void add_motion(std::span<RelaxedBody> bodies, std::span<const Real> late) const;
  /// Writes the impulses of the whole step to the problem and the contacts.
  void finish();

 private:
  struct Row {
    Real inverse_stiffness;      // change of u per unit impulse, softness included
    Real impulse, lower, upper;  // bounds and impulse of a sub-step
    Real softness, sum = 0;      // softness; impulse of the whole step
    Real shift = 0;              // integral of the sum over the step
    // Changes of the speed since the start of the step: before this sub-step, and after the last solution.
    Real before = 0, after = 0;
    bool acts = false;      // whether the time from which it acts has come
    bool is_ready = false;  // whether its responses are known
    // Responses of the links to a unit impulse; empty if only the responses of the row's own two links are
    // known, in `response_a` and `response_b`.
    std::vector<Vec6> response;
    std::vector<Vec6> reaction;  // impulses of the joints due to a unit impulse
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
    // Impulses of the joints: `now` in this sub-step, `sum` in the step so far. `shift`: integral of `sum`
    // over the step.
    std::vector<Vec6> now, sum, shift;
  };

  void prepare(Part& part, std::span<const RelaxedBody> bodies);
  void prepare_row(Part& part, const BoundedRow& r, Row& row, std::span<const RelaxedBody> bodies,
                   bool whole);
  void soften(Part& part, Real elapsed);
  void join(Part& part, std::span<BodyMotion> motions, Real elapsed);
  void push(Part& part, const BoundedRow& r, const Row& row, Real impulse,
            std::span<BodyMotion> motions) const;
  void solve_contacts(Part& part, std::span<BodyMotion> motions, Real elapsed, bool is_last);
  Real speed(const BoundedRow& r, std::span<const BodyMotion> motions) const;
  static Real speed_change(const BoundedRow& r, std::span<const BodyMotion> motions);

  JointProblem problem_;
  std::span<LinkContact> contacts_;
  std::vector<Part> parts_;
  std::vector<Row> rows_, contact_rows_;
  std::span<const RelaxedBody> bodies_;
  Real substep_ = 0, duration_ = 0;
};

}  // namespace offstage::sim
