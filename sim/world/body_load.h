#pragma once
/// The force that particles or cloths exert on a body from sub-step to sub-step.

#include <array>

#include "sim/dynamics/rigid_body.h"

namespace offstage::sim {

/// Particles and cloths move after the bodies. Therefore bodies move under the force that is expected from
/// those of the last sub-steps, and the difference acts at the end of the sub-step. Joints, springs, drag and
/// contacts of a body thus resist the load within the sub-step in which it acts.
class BodyLoad {
 public:
  /// Begins a sub-step: extrapolates the force. A load persists, so one that changes much is expected with
  /// the smaller of its last two values.
  void expect(const RigidBody& body);
  /// Expects no force in the sub-step that begins.
  void expect_nothing() { expected_ = {}; }
  const Wrench& expected() const { return expected_; }  ///< [N], [N m]
  /// Ends a sub-step with the force that has acted.
  void record(const Wrench& force) { last_ = {force, last_[0], last_[1]}; }
  /// Returns the force that acted in the last sub-step.
  const Wrench& last() const { return last_[0]; }
  /// Whether no force has acted in the last sub-steps.
  bool is_over() const;

 private:
  std::array<Wrench, 3> last_;  // newest first
  Wrench expected_;
};

}  // namespace offstage::sim
