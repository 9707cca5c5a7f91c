#pragma once
/// Implementation of the World: its objects, and the stages of a sub-step (docs/step.md). Each stage is a
/// class with the data that it keeps from sub-step to sub-step; step.cpp calls the stages one after the
/// other.

#include <vector>

#include <oneapi/tbb/task_arena.h>

#include "sim/world/active_bodies.h"
#include "sim/world/body_reactions.h"
#include "sim/world/cloth_motion.h"
#include "sim/world/contact_finder.h"
#include "sim/world/contact_solver.h"
#include "sim/world/free_motion.h"
#include "sim/world/joint_groups.h"
#include "sim/world/particle_motion.h"

namespace offstage::sim {

struct World::Impl : WorldState {
  // Time (step.cpp)
  StepReport step(Real sampling_time, const BeforeSubStep& before);
  StepReport prewarm(Real from, Real to, const BeforeSubStep& before);
  Real first_part(Real h);
  void substep(Real start, Real end, StepReport& report);
  void begin_bodies(Real start, Real end, StepReport& report);
  void begin_kinematic(Real start, Real end);
  void explode(Real start, Real end);
  void move_bodies(Real start, Real h, StepReport& report);
  void step_particles(Real start, Real h, const CoupledSystem& coupled, StepReport& report);
  void update_joints();
  bool is_within_bounds(const Body& body) const;
  void retire(Body& body, StepReport& report);
  void collect_moved();

  // Objects that are removed, or exist for some time only (presence.cpp)
  void update_presence(Real time);
  void appear(Body& body, Real time);
  void take_out(Body& body);
  void update_joint_presence(Real time);
  void detach(Body& body);
  void remove_dead_springs();
  void wake_neighbours(Body& body);
  void wake_overlapped(const Body& body, const Pose& pose);
  void wake_at_springs(const Body& body);
  void wake_at_jumps(Real start, Real end);

  // Time is a base plus an integer number of equal sampling times, so that rounding errors do not add up.
  Real base_time = 0, sampling_time = 0;
  uint64_t samplings = 0;
  Real now = 0;

  std::vector<MovedBody> moved;
  uint64_t born = 0;            // particles created since the last report
  bool has_lifetimes = false;   // whether any body, joint or cloth appears or is removed at a time
  std::vector<Island> islands;  // islands of the last sub-step
  tbb::task_arena serial{1};

  ActiveBodies active{*this};
  JointGroups joint_groups{*this};
  FreeMotion free_motion{*this};
  ContactMaterials materials;
  ContactFinder contacts{*this, materials, active, joint_groups};
  ContactSolver contact_solver{*this};
  ParticleMotion particle_motion{*this, active, joint_groups};
  ClothMotion cloth_motion{*this, active};
  BodyReactions reactions{*this, active, joint_groups};
};

}  // namespace offstage::sim
