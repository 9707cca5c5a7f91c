#pragma once
/// The part of a contact problem that comes from joints (physics A3, A4): constraints, which hold for any
/// contact impulses, and rows for limits, motors and friction, whose impulses have bounds. Bodies have the
/// same indices as in the contacts.

#include <span>

#include "sim/articulation/joint_rows.h"

namespace offstage::sim {

/// Index used for a body that impulses do not move.
constexpr uint32_t kUnmoved = UINT32_MAX;

/// The condition J (v+ - v) = 0. The velocities on entry already satisfy the joint.
struct JointConstraint {
  uint32_t a, b;
  const JointRows* rows;
};

/// A condition on the speed u = on_a . v_a + on_b . v_b + offset, with a bounded impulse p. The solution has
/// u = target - softness p; if this requires an impulse beyond a bound, p equals that bound.
struct BoundedRow {
  uint32_t a = kUnmoved, b = kUnmoved;
  Vec6 on_a = Vec6::Zero(), on_b = Vec6::Zero();
  Real offset =
      0;  ///< contribution of kinematic links and of the rotation of the row's direction [m/s] or [rad/s]
  Real target = 0;            ///< [m/s] or [rad/s]
  Real softness = 0;          ///< [1/kg] or [1/(kg m^2)], >= 0
  Real lower = 0, upper = 0;  ///< bounds of the impulse [N s] or [N m s]
  Real impulse = 0;           ///< in: a guess; out: the solution
  /// For solutions that divide the interval: `target` decreases by `lag` times the change of u from the
  /// interval's start to the start of the part.
  Real lag = 0;
  // For the fast solver: `from` is the fraction of the interval after which the row acts. `turning` is added
  // to u at the interval's start and decreases linearly to 0 at its end [m/s] or [rad/s]: the change of
  // `offset` as the row turns or, for a motor, its target minus the speed at the start.
  Real from = 0, turning = 0;
  bool resists_change =
      false;  ///< whether `target` is the speed u before the solution: the row resists its change
};

struct JointProblem {
  std::span<const JointConstraint> constraints;
  std::span<BoundedRow> bounded;
  std::span<Vec6>
      impulses;  ///< impulses of each constraint, one element per row; in: a guess; out: the solution

  bool empty() const { return constraints.empty() && bounded.empty(); }
};

}  // namespace offstage::sim
