#pragma once
/// Motion of particles through a sub-step, among bodies that have moved through it, and their collisions
/// (physics P3-P8).

#include <vector>

#include "sim/dynamics/body_impulses.h"
#include "sim/particles/particle_collisions.h"
#include "sim/world/coupled_system.h"
#include "sim/world/joint_groups.h"
#include "sim/world/obstacle_set.h"

namespace offstage::sim {

class ParticleMotion {
 public:
  ParticleMotion(WorldState& world, const ActiveBodies& active, const JointGroups& joints)
      : world_(world), active_(active), joints_(joints) {}

  /// Moves all particles through a sub-step, except those that `coupled` has moved freely: these only
  /// collide. Returns whether any ended.
  bool step(Real start, Real h, const CoupledSystem& coupled, StepReport& report);
  /// Impulses on bodies in the last sub-step, by slot.
  std::vector<Reaction> reactions() const { return impulses_.sums(); }
  /// Events of the last sub-step.
  std::vector<ParticleEvent>& events() { return events_; }
  void forget(ParticleSystemHandle system);

  /// Begins and ends a time before the film in which bodies stay where they are. Systems that have particles
  /// when the first such time begins are paused until the last has ended.
  void begin_prewarm(bool is_first);
  void end_prewarm(bool is_last);

 private:
  bool waits(ParticleSystemHandle system) const;
  ContactWork collide(const ParticleStage& stage, const CoupledSystem& coupled);
  void add(std::vector<ParticleEvent>& events);

  WorldState& world_;
  const ActiveBodies& active_;
  const JointGroups& joints_;
  ObstacleSet obstacles_;
  ParticleCollisions collisions_;
  BodyImpulses impulses_;
  std::vector<ParticleEvent> events_;
  bool is_prewarming_ = false;
  std::vector<ParticleSystemHandle> waiting_;  // systems that are paused while others are prewarmed
};

}  // namespace offstage::sim
