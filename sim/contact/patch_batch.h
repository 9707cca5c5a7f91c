#pragma once
/// Eight contact patches in SIMD lanes, as the fast solver works on them (relaxation.h).
///
/// A patch acts by a wrench about its centre, and what it feels is the relative twist there, in its frame.
/// Both come in two groups of three: the normal group (linear along n, angular about t and k), by which the
/// normal forces of all points act, and the friction group (linear along t and k, angular about n). A point
/// at (x, y) along (t, k) has the normal velocity u_n + y w_t - x w_k, and its force f makes the wrench
/// (f, y f, -x f) of the normal group.
///
/// All is in single precision. Of velocities and places only what changes within the step is: a body's
/// velocity at the start may be great, and what it makes between two bodies is found in double precision.

#include <array>
#include <cstdint>
#include <span>

#include "sim/contact/contact_coloring.h"
#include "sim/linear/lane_vector.h"

namespace offstage::sim {

struct ContactPatch;
struct RelaxedBody;

/// A body within a step, against one that keeps its velocity: the change of velocity since the start, and how
/// far that has moved and turned it. Linear in elements 0 to 2, angular in 4 to 6.
struct BodyMotion {
  FloatLanes velocity{}, shift{};
};

/// Twists and wrenches of the patches, by group.
struct PatchGroups {
  LaneVector<FloatLanes> normal;    ///< along n, about t, about k
  LaneVector<FloatLanes> friction;  ///< along t, along k, about n
};

struct PatchBatch {
  using Lanes = FloatLanes;
  using Vector = LaneVector<Lanes>;
  using Symmetric = LaneSymmetric<Lanes>;
  using Index = ContactColoring::Batch;  ///< by lane

  struct Point {
    Lanes x, y, radius;   ///< along t and k, and from the centre [m]
    Lanes mass;           ///< effective [kg], 0 in lanes that have no such point
    Lanes start;          ///< separation at the start of the step [m]
    Lanes impulse, mean;  ///< of a sub-step, and over the time before [N s]
    Lanes before;         ///< of the sub-steps before [N s]
    Lanes shift;          ///< mass times the way that these brought: in sub-steps [N s], in the end [kg m]
    Lanes push;           ///< of that, what took penetration away [kg m]
  };

  Index a, b, patch;  ///< the body beyond the last and kNone in lanes that are not used
  std::array<bool, ContactColoring::kLanes> moves_a, moves_b;
  uint32_t count;   ///< of points, in the lane that has most
  float tolerance;  ///< of the next sweep's rounds [m/s]
  Vector n, t, k, arm_a, arm_b;
  Lanes inverse_mass_a, inverse_mass_b;
  Symmetric inverse_inertia_a, inverse_inertia_b;
  /// The twist that a unit wrench gives: within the normal group, within the friction group, and of the
  /// friction group by the normal group's wrench.
  Symmetric normal_mobility, friction_mobility;
  LaneMatrix<Lanes> coupling;
  /// The inverse of friction_mobility. Of patches of one point, which has no torque, that of the part along t
  /// and k, and in zz 1 / a bound on its eigenvalues.
  Symmetric friction_stiffness;
  PatchGroups approach;  ///< the twist that the velocities at the start make, moving surfaces included
  Lanes conveyed;        ///< of that, what surfaces add along n [m/s]
  Lanes friction_t, friction_k;
  Vector friction_impulse, friction_mean, friction_before, friction_shift;  ///< along t, k, about n, likewise
  Lanes pressure;  ///< sum of the normal impulses that friction was found with, if the patch slides; else 0
                   ///< [N s]
  Lanes holds;     ///< all ones where friction was well within its limit in the last sweep, else 0
  Lanes renewal;   ///< share of the difference that means follow their impulses by
  Lanes residual;  ///< by how much the last sweep changed the velocity of the centre [m/s]
  bool turns;      ///< whether `gain` counts
  std::array<Point, 4> points;
  PatchGroups gain;  ///< of the approach by turning arms and frames, see ContactPatch
  Vector bow;        ///< likewise, of the centre along n, t, k
};

/// When a sub-step is.
struct SubstepTime {
  Real substep;   ///< its length [s]
  Real elapsed;   ///< since the step's start, when it begins [s]
  Real duration;  ///< of the step [s]
  /// What turning arms and frames add at its end, see ContactPatch: the s of then, and the sums of s and of
  /// s^2 over the sub-steps before, times their length [s].
  float s, s_sum, s2_sum;

  SubstepTime(Real substep_, uint32_t index, Real duration_);
};

/// Fills a batch and gives the bodies the impulses that the patches' forces make in `substep` [s]. Of
/// motions there is one more than bodies, for lanes that are not used.
void prepare(PatchBatch& batch, const PatchBatch::Index& patches, std::span<const ContactPatch> all,
             std::span<const RelaxedBody> bodies, std::span<BodyMotion> motions, Real substep);

/// A sub-step ends, and the next one begins with its impulses.
void begin_substep(PatchBatch& batch);

/// Solves each patch once, for velocities. Where a gap is open, the approach is limited to what closes it in
/// the sub-step.
void sweep(PatchBatch& batch, std::span<BodyMotion> motions, const SubstepTime& time);

/// The last sub-step has moved the bodies: from now on Point::shift counts ways, and pushes begin.
void end_substeps(PatchBatch& batch, Real substep);

/// How penetration is taken away.
struct PushOut {
  SubstepTime time;  ///< of what would be the next sub-step
  Real share;        ///< of the depth that a push takes away
  Real limit;        ///< the farthest that pushes move in a step [m]
};
/// Moves the bodies, but not their velocities, apart where they overlap, and takes back of what it did before
/// where that opened a gap, as far as it did. Returns by lanes the farthest way that it wanted [m].
FloatLanes push_out(PatchBatch& batch, std::span<BodyMotion> motions, const PushOut& push);

/// Gives the patches their forces.
void report(const PatchBatch& batch, std::span<ContactPatch> patches, Real substep);

}  // namespace offstage::sim
