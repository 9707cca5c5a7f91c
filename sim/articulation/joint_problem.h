#pragma once
/// What joints add to a contact problem (physics A3, A4): constraints, which any impulses of contacts leave
/// as they are, and rows for limits, motors and friction, whose impulses have bounds. Bodies are indexed as
/// by the contacts.

#include <span>

#include "sim/articulation/joint_rows.h"

namespace offstage::sim {

/// In place of a body: one that no impulse moves.
constexpr uint32_t kUnmoved = UINT32_MAX;

/// J (v+ - v) = 0: the velocities that come in already are as the joint wants them.
struct JointConstraint {
  uint32_t a, b;
  const JointRows* rows;
};

/// u = on_a . v_a + on_b . v_b + offset becomes `target` - softness p, if p is within the bounds; else p is
/// the bound in that direction.
struct BoundedRow {
  uint32_t a = kUnmoved, b = kUnmoved;
  Vec6 on_a = Vec6::Zero(), on_b = Vec6::Zero();
  Real offset = 0;            ///< what links that are driven add [m/s] or [rad/s]
  Real target = 0;            ///< likewise
  Real softness = 0;          ///< [1/kg] or [1/(kg m^2)], >= 0
  Real lower = 0, upper = 0;  ///< of the impulse [N s] or [N m s]
  Real impulse = 0;           ///< in: a guess; out: the solution
};

struct JointProblem {
  std::span<const JointConstraint> constraints;
  std::span<BoundedRow> bounded;
  std::span<Vec6> impulses;  ///< of the constraints, by their rows; in: a guess; out: the solution

  bool empty() const { return constraints.empty() && bounded.empty(); }
};

}  // namespace offstage::sim
