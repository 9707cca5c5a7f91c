#pragma once
/// Motion of particles through a sub-step, among bodies and cloths that have moved through it, and their
/// collisions (physics P3-P8).

#include <map>
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

  /// Moves all particles through a sub-step and resolves their collisions. Particles that `coupled` has moved
  /// already only collide. `expected`: loads of bodies, by slot. Returns whether any particle was removed.
  bool step(Real start, Real h, const CoupledSystem& coupled, std::map<uint32_t, BodyImpulses::Load> expected,
            StepReport& report);
  /// Box around the paths of the particles that collide with bodies and may rest on them, in the next
  /// sub-step of length h [s].
  Aabb colliding_bounds(Real h) const;
  /// Impulses on bodies in the last sub-step.
  const BodyImpulses& impulses() const { return impulses_; }
  /// Events of the last sub-step.
  std::vector<ParticleEvent>& events() { return events_; }
  void forget(ParticleSystemHandle system);

  /// Begin and end a call of World::prewarm(), in which dynamic bodies do not move. Systems that have
  /// particles when the first call begins are paused until the last call has ended.
  void begin_prewarm(bool is_first);
  void end_prewarm(bool is_last);

 private:
  bool waits(ParticleSystemHandle system) const;
  ContactWork collide(const ParticleStage& stage, const CoupledSystem& coupled);
  void add(std::vector<ParticleEvent>& events);
  void gather_cloths(Real h);
  void return_cloths();

  WorldState& world_;
  const ActiveBodies& active_;
  const JointGroups& joints_;
  ObstacleSet obstacles_;
  ClothObstacles cloths_;
  ParticleCollisions collisions_;
  BodyImpulses impulses_;
  std::vector<ParticleSystem*> colliding_;  // the systems of collisions_ in this sub-step
  std::vector<ParticleEvent> events_;
  bool is_prewarming_ = false;
  std::vector<ParticleSystemHandle> waiting_;  // systems that are paused while others are prewarmed
};

}  // namespace offstage::sim
