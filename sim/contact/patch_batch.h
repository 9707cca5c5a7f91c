#pragma once
/// Eight contact patches in SIMD lanes, the unit of work of the fast solver (relaxation.h).
///
/// A patch applies a wrench about its centre and reads the relative twist there, both in its frame. Twist and
/// wrench have two groups of three components. The normal group (linear along n, angular about t and k)
/// contains the normal forces of all points. The friction group is linear along t and k, and angular about n.
/// A point at (x, y) along (t, k) has the normal velocity u_n + y w_t - x w_k, and its force f has the wrench
/// (f, y f, -x f) in the normal group.
///
/// All computations are in single precision. They use only the changes of velocities and positions within the
/// step. A body's velocity at the start may be large, so relative velocities at the start are computed in
/// double precision.

#include <array>
#include <cstdint>
#include <span>

#include "sim/contact/contact_coloring.h"
#include "sim/linear/lane_vector.h"

namespace offstage::sim {

struct ContactPatch;
struct RelaxedBody;

/// Deviation of a body from uniform motion within a step: `velocity` is the change of its velocity since the
/// step's start, `shift` the resulting displacement and rotation. Elements 0 to 2 are linear [m/s, m],
/// elements 4 to 6 angular [rad/s, rad].
struct BodyMotion {
  FloatLanes velocity{}, shift{};
};

/// Twists and wrenches of the patches, by group.
struct PatchGroups {
  LaneVector<FloatLanes> normal;    ///< components along n, about t and about k
  LaneVector<FloatLanes> friction;  ///< components along t, along k and about n
};

struct PatchBatch {
  using Lanes = FloatLanes;
  using Vector = LaneVector<Lanes>;
  using Symmetric = LaneSymmetric<Lanes>;
  using Index = ContactColoring::Batch;  ///< an index for each lane

  struct Point {
    Lanes x, y, radius;   ///< coordinates along t and k, and distance from the centre [m]
    Lanes mass;           ///< effective mass [kg], 0 in lanes without this point
    Lanes start;          ///< separation at the start of the step [m]
    Lanes impulse, mean;  ///< impulse of a sub-step, and its moving average over previous sub-steps [N s]
    Lanes before;         ///< sum of the impulses of previous sub-steps [N s]
    Lanes shift;  ///< mass times the displacement due to `before`: during sub-steps [N s], at the end [kg m]
    Lanes push;   ///< part of `shift` that removed penetration [kg m]
  };

  Index a, b, patch;  ///< indices; in unused lanes, bodies.size() for a and b, kNone for patch
  std::array<bool, ContactColoring::kLanes> moves_a, moves_b;
  uint32_t count;  ///< greatest number of points in a lane
  bool is_fresh;   ///< whether the next sweep solves the patches completely
  bool alone;      ///< whether no other patch corrects remaining errors; see prepare()
  Vector n, t, k, arm_a, arm_b;
  Lanes inverse_mass_a, inverse_mass_b;
  Symmetric inverse_inertia_a, inverse_inertia_b;
  /// Mobilities: twist per unit wrench within the normal group, and within the friction group. `coupling`:
  /// twist of the friction group per unit wrench of the normal group.
  Symmetric normal_mobility, friction_mobility;
  LaneMatrix<Lanes> coupling;
  /// Inverse of friction_mobility. Patches of one point have no torque. For them it is the inverse of the 2 x
  /// 2 part along t and k, and zz is the reciprocal of an upper bound of the eigenvalues of this part.
  Symmetric friction_stiffness;
  PatchGroups approach;  ///< twist due to the velocities at the start, conveyors included
  Lanes conveyed;        ///< component of `approach` along n due to conveyors [m/s]
  Lanes friction_t, friction_k;
  Lanes allowed;                         ///< overlap that push-out leaves; see RelaxedBody::is_link [m]
  bool resists_turning;                  ///< whether a lane has rolling or spinning friction
  Lanes rolling;                         ///< radius of the disc of rolling friction per normal impulse [m]
  Lanes spin_arm;                        ///< spinning friction divided by the coefficient of friction [m]
  Vector rolling_impulse;                ///< angular impulse about t and k, in y and z; x is 0 [N m s]
  Vector rolling_before, rolling_shift;  ///< rolling friction, as Point::before and Point::shift
  /// Friction along t and k, and about n; for the meanings see Point.
  Vector friction_impulse, friction_mean, friction_before, friction_shift;
  /// Sum of the normal impulses for which the friction was computed, if the patch slides; else 0 [N s].
  Lanes pressure;
  Lanes holds;     ///< mask: all bits set if friction was well below its limit in the last sweep
  Lanes renewal;   ///< weight of the new impulse in the moving averages, per sub-step
  Lanes residual;  ///< change of the velocity of the patch's centre in the last sweep [m/s]
  bool turns;      ///< whether `gain` is used
  std::array<Point, 4> points;
  PatchGroups gain;  ///< ContactPatch::gain, including gain_along_t and gain_along_k
  Vector bow;        ///< ContactPatch::bow, along n, t, k
  Lanes acting;      ///< ContactPatch::acting
};

/// The times of a sub-step within a step.
struct SubstepTime {
  Real substep;   ///< length of the sub-step [s]
  Real elapsed;   ///< time from the step's start to the beginning of the sub-step [s]
  Real duration;  ///< length of the step [s]
  /// Factors of `gain` and `bow` (see ContactPatch): s at the end of the sub-step, and the sums of s and of
  /// s^2 over previous sub-steps, multiplied by the length of a sub-step [s].
  float s, s_sum, s2_sum;

  SubstepTime(Real substep_, uint32_t index, Real duration_);
};

/// Fills a batch and applies the impulses of the patches' initial forces over `substep` [s] to the bodies.
/// `motions` has one element more than `bodies`, for unused lanes. `alone`: whether one of the bodies touches
/// only bodies that contacts do not move, so that no other patch corrects the errors that remain in this
/// batch.
void prepare(PatchBatch& batch, const PatchBatch::Index& patches, std::span<const ContactPatch> all,
             std::span<const RelaxedBody> bodies, std::span<BodyMotion> motions, Real substep, bool alone);

/// Ends a sub-step. The next sub-step starts from the same impulses.
void begin_substep(PatchBatch& batch);

/// Solves each patch of the batch once and updates the velocities in `motions`. At an open gap the approach
/// is limited to the speed that closes the gap within the sub-step.
void sweep(PatchBatch& batch, std::span<BodyMotion> motions, const SubstepTime& time);

/// Ends the sub-steps, before push-out begins. Converts Point::shift to mass times displacement [kg m].
void end_substeps(PatchBatch& batch, Real substep);

/// Parameters of the removal of penetration.
struct PushOut {
  SubstepTime time;  ///< time of the sub-step after the last one
  Real fraction;     ///< fraction of the depth that one sweep removes
  Real limit;        ///< greatest displacement by push-out in a step [m]
};
/// Separates overlapping bodies by moving them, without a change of their velocities. If an earlier call
/// opened a gap, its displacement is reduced as far as necessary. Returns, by lane, the greatest displacement
/// that a point required, before limits [m].
FloatLanes push_out(PatchBatch& batch, std::span<BodyMotion> motions, const PushOut& push);

/// Writes the forces and impulses of the step to the patches (the members of ContactPatch marked as out).
/// `substep`: length of a sub-step [s].
void report(const PatchBatch& batch, std::span<ContactPatch> patches, Real substep);

}  // namespace offstage::sim
