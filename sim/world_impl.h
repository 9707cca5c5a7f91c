#pragma once
/// The inside of the World, shared by the files that implement it.

#include <memory>
#include <optional>
#include <vector>

#include "sim/collision/broad_phase.h"
#include "sim/collision/collision_shape.h"
#include "sim/collision/distance.h"
#include "sim/collision/obstacles.h"
#include "sim/dynamics/particle_system.h"
#include "sim/dynamics/rigid_body.h"
#include "sim/world.h"

namespace offstage::sim {

class CoupledSystem;

/// A body of the world. Its `solid` points into it and to its mesh, so it stays where it was made.
struct Body {
  BodyDef def;
  Solid solid;
  RigidBody rigid;  // dynamic bodies only
  Pose pose;        // now
  Pose before_substep, before_step;
  bool frozen = false;

  bool is_dynamic() const { return def.motion == MotionType::dynamic && !frozen; }
  bool is_kinematic() const { return def.motion == MotionType::kinematic && !frozen; }
  bool can_move() const { return is_dynamic() || (is_kinematic() && def.track.moves()); }
  /// Made when another body first comes near, because a mesh may have to be decomposed for it.
  const CollisionShape& collision_shape();
  /// Pose and velocities of the body's origin at a time not far from now.
  Motion motion(Real now, Real time) const;

 private:
  std::optional<CollisionShape> collision_shape_;
};

struct Spring {
  SpringDef def;
  Real rest_length;
};

/// The objects of a world.
struct WorldState {
  WorldDef def;
  SlotMap<std::unique_ptr<CollisionMesh>, MeshTag> meshes;
  SlotMap<std::unique_ptr<Body>, BodyTag> bodies;
  SlotMap<ParticleSystem, ParticleSystemTag> systems;
  SlotMap<Spring, SpringTag> springs;

  ParticleForces forces(const ParticleSystem& system) const { return {system.def, def.gravity, def.wind}; }
  /// Whether the object that an attachment names exists.
  bool is_alive(const Attachment& a) const;
  Vec3 position(const Attachment& a) const;
  void remove_dead_springs();
};

struct World::Impl : WorldState {
  StepReport step(Real sampling_time, const BeforeSubStep& before);
  void substep(Real start, Real end, StepReport& report);
  void step_particles(Real start, Real h, const CoupledSystem& coupled, StepReport& report);
  void keep_within_bounds(BodyHandle handle, Body& body, StepReport& report);
  void update_obstacles(Real h);
  void find_contacts(Real start, Real h, StepReport& report);
  void collect_moved();

  // Time is a base plus a whole number of equal samplings: no sum of rounded steps.
  Real base_time = 0, sampling_time = 0;
  uint64_t samplings = 0;
  Real now = 0;

  std::vector<MovedBody> moved;
  uint64_t born = 0;  // since the last report

  BroadPhase broad_phase;  // of the bodies that collide, by slot

  // What particles can hit in the current sub-step. What cannot move is arranged anew only when it changed
  // (E9).
  Obstacles fixed_obstacles, moving_obstacles;
  bool fixed_changed = true;
};

}  // namespace offstage::sim
