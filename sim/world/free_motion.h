#pragma once
/// Motion of bodies through a sub-step without contacts, together with what springs and joints connect to
/// them (physics E6). The systems that moved them are kept until the next sub-step, because they can restore
/// the states from which they started.

#include <memory>
#include <vector>

#include "sim/world/active_bodies.h"
#include "sim/world/coupled_system.h"

namespace offstage::sim {

class FreeMotion {
 public:
  explicit FreeMotion(WorldState& world) : world_(world) {}

  void begin_substep() { systems_.clear(); }
  /// Moves the bodies, which are all that are awake, and the particles held by springs through a sub-step.
  void move_all(std::span<Body* const> awake, Real start, Real h);
  /// Moves some bodies, with the objects connected to them, for `duration` from `from` on, which is a time
  /// since the sub-step's start.
  CoupledSystem& move_group(std::span<Body* const> group, Real start, Real from, Real duration);
  /// The system of all bodies in this sub-step.
  CoupledSystem& whole() const { return *systems_.front(); }
  /// The system that has moved bodies last.
  CoupledSystem& last() const { return *systems_.back(); }
  /// Adds the statistics of this sub-step to the report.
  void count(StepReport& report) const;

 private:
  WorldState& world_;
  std::vector<std::unique_ptr<CoupledSystem>> systems_;  // of this sub-step
};

}  // namespace offstage::sim
