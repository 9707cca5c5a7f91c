#pragma once
/// Contact-free motion of bodies through a sub-step, together with the objects that springs and joints
/// connect to them (physics E6). The CoupledSystem objects are kept until the next sub-step, because they can
/// restore their initial states.

#include <memory>
#include <vector>

#include "sim/world/active_bodies.h"
#include "sim/world/coupled_system.h"

namespace offstage::sim {

class FreeMotion {
 public:
  explicit FreeMotion(WorldState& world) : world_(world) {}

  void begin_substep() { systems_.clear(); }
  /// Moves all awake bodies, and particles with springs or pair forces, through a sub-step. It begins at time
  /// `start` and has length h [s]. `awake` must contain all awake bodies.
  void move_all(std::span<Body* const> awake, Real start, Real h);
  /// Moves some bodies, and the objects connected to them, for `duration` [s]. The motion begins at time
  /// `start` + `from`, where `start` is the start of the sub-step.
  CoupledSystem& move_group(std::span<Body* const> group, Real start, Real from, Real duration);
  /// The system that move_all() created in this sub-step.
  CoupledSystem& whole() const { return *systems_.front(); }
  /// The system that moved bodies most recently.
  CoupledSystem& last() const { return *systems_.back(); }
  /// Adds the statistics of this sub-step to the report.
  void count(StepReport& report) const;

 private:
  void find_motion_forces(std::span<Body* const> awake);

  WorldState& world_;
  std::vector<std::unique_ptr<CoupledSystem>> systems_;  // systems of this sub-step
};

}  // namespace offstage::sim
