#pragma once
/// Implementation of the World, shared by several source files.

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <oneapi/tbb/task_arena.h>

#include "sim/articulation/articulation.h"
#include "sim/cloth/cloth_system.h"
#include "sim/collision/grouped_broad_phase.h"
#include "sim/collision/obstacles.h"
#include "sim/contact/contact_graph.h"
#include "sim/contact/fast_contacts.h"
#include "sim/contact/island_impacts.h"
#include "sim/contact/seams.h"
#include "sim/contact/solver_choice.h"
#include "sim/dynamics/body.h"
#include "sim/dynamics/body_impulses.h"
#include "sim/particles/particle_collisions.h"
#include "sim/particles/particle_system.h"
#include "sim/world.h"

namespace offstage::sim {

class CoupledSystem;

struct Spring {
  SpringDef def;
  Real rest_length;
};

/// Returns the smallest number of equal sub-steps of a duration that are not longer than `longest`. A ratio
/// that is an integer within rounding is rounded to it.
uint32_t substep_count(Real duration, Real longest);

/// The objects of a world.
struct WorldState {
  WorldDef def;
  SlotMap<std::unique_ptr<CollisionMesh>, MeshTag> meshes;
  SlotMap<std::unique_ptr<Body>, BodyTag> bodies;
  SlotMap<ParticleSystem, ParticleSystemTag> systems;
  SlotMap<Spring, SpringTag> springs;
  SlotMap<ForceDef, ForceTag> force_defs;
  SlotMap<std::unique_ptr<Cloth>, ClothTag> cloths;
  SlotMap<std::unique_ptr<Joint>, JointTag> joints;
  std::vector<std::unique_ptr<Articulation>> articulations;  // the connected components of the intact joints

  /// Forces on each single particle of a system.
  ParticleForces forces(const ParticleSystem& system) const;
  /// Whether there are forces between particles.
  bool has_pair_forces() const;
  /// Whether the object of an attachment exists.
  bool is_alive(const Attachment& a) const;
  /// Whether both ends of a spring exist at this time.
  bool acts(const Spring& spring) const;
  Vec3 position(const Attachment& a) const;
};

struct World::Impl : WorldState {
  StepReport step(Real sampling_time, const BeforeSubStep& before);
  void substep(Real start, Real end, StepReport& report);
  void begin_kinematic(Real start, Real end);
  void collect_moved();

  // Motion of bodies (step.cpp)
  void begin_bodies(Real start, Real end);
  void explode(Real start, Real end);
  std::vector<const ForceDef*> active_forces() const;
  void move_bodies(Real start, Real h, StepReport& report);
  void move_all(Real start, Real h);
  CoupledSystem& move_some(std::span<Body* const> group, Real start, Real from, Real duration);
  bool is_within_bounds(const Body& body) const;
  void retire(Body& body, StepReport& report);

  // Objects that exist for some time only (presence.cpp)
  void update_presence(Real time);
  void appear(Body& body, Real time);
  void take_out(Body& body);
  void update_joint_presence(Real time);
  void place(Joint& joint);

  /// Whether each collision is resolved at its own time, and contacts are solved to rounding.
  bool is_exact() const { return def.solver == SolverKind::exact || def.solver == SolverKind::lcp; }

  // Contacts (contact_stage.cpp)
  PairSurface surface_of(const Body& a, const Body& b) const;
  void propagate_impact_speeds(Real h);
  void update_pairs(Real h);
  Real motion_bound(const ContactPair& pair, Real left) const;
  Real motion_known(const ContactPair& pair) const;
  void find_points(ContactPair& pair, Real time, Real h) const;
  void choose_event(ContactPair& pair, bool far, Real left) const;
  void remove_seams(std::span<ContactPair* const> pairs, Real time, Real h) const;
  void move_in_broad_phase(Body& body, Aabb way, bool again);
  bool move_in_broad_phase(Body& body, bool again);
  void collect_pairs(bool again);
  std::vector<Body*> wake_touched(Real start, Real h);
  void find_moving_islands(bool (*connect)(const ContactPair&));
  void solve_islands(Real start, Real h, StepReport& report);
  void solve(std::span<Island* const> group, const ContactInterval& interval, StepReport& report);
  void settle_joints(const Island& island, Real end, Real most_energy);
  static Real most_energy(const Island& island, Real share);
  static void add_rough(const ContactPair* pair, StepReport& report);
  void count_contacts(StepReport& report) const;

  // Impacts (impact_stage.cpp)
  struct Impact {
    Real time;  ///< since the sub-step's start [s]
    ContactPair* pair;
  };
  void resolve_impacts(Real start, Real h, StepReport& report);
  std::optional<sim::Impact> first_impact(const MovingShape& a, const MovingShape& b) const;
  std::optional<Real> impact_time(const ContactPair& pair, Real h, TestCounts& tests) const;
  std::optional<Real> tumbling_impact_time(const ContactPair& pair, Real from, Real h, Real turn,
                                           TestCounts& tests) const;
  std::optional<Real> point_impact_time(const ContactPair& pair, Real h) const;
  void join_pending(uint32_t number, Real start, Real time, Real h, std::span<const Impact> impacts,
                    StepReport& report);
  void suppress_restitution(uint32_t island, StepReport& report);
  void bring_to(Island& island, Real start, Real time, Real h, StepReport& report);
  void join(uint32_t into, uint32_t island);
  void find_pairs_again(uint32_t island, Real start, Real h, StepReport& report);
  std::size_t collide(uint32_t island, Real start, Real time, Real h, StepReport& report);
  void go_on(uint32_t island, Real start, Real time, Real h, StepReport& report);
  bool join_next(uint32_t island, Real start, Real time, Real h, StepReport& report);
  bool join_overtaken(uint32_t number, Real start, Real time, Real h, StepReport& report);
  bool overlaps_at_end(const ContactPair& pair, Real time, Real h) const;
  bool closes(const ContactPair& pair, Real left) const;

  uint32_t surface_number(const std::string& material);
  void detach(Body& body);
  void remove_dead_springs();
  void wake_neighbours(Body& body);

  // Rest (sleep_stage.cpp)
  void wake(Body& body);
  void wake_all();
  void watch_springs(std::span<Body* const> group);
  Wrench spring_push(const Spring& spring, const Body& body, Real time) const;
  Wrench changing_push(const Body& body, Real time) const;
  bool is_pushed(const Body& body, const Wrench& now, const Wrench& at_rest) const;
  void wake_pushed(Real time);
  void put_to_sleep(Real start, Real h);
  void rank_bodies();
  void update_lists();

  // Joints (joint_stage.cpp)
  void update_articulations();
  void break_joints(Real h, StepReport& report);
  void detach_joints(const Body& body);
  bool is_driven(const Island& island, Real time) const;
  bool are_jointed(const Body& a, const Body& b) const;

  // Particles
  StepReport prewarm(Real from, Real to, const BeforeSubStep& before);
  bool waits(ParticleSystemHandle system) const;
  void step_particles(Real start, Real h, const CoupledSystem& coupled, StepReport& report);
  Obstacle swept_obstacle(const Body& body, Real h) const;
  void update_obstacles(Real h);
  ContactWork collide_particles(const ParticleStage& stage, const CoupledSystem& coupled);
  void add_events(std::vector<ParticleEvent>& events);
  void push_bodies(std::span<const Reaction> reactions, Real time);

  // Cloths (cloth_stage.cpp)
  void arrange_cloths();
  void begin_cloths();
  std::vector<ClothBody> bodies_near_cloths(Real h) const;
  void step_cloths(Real start, Real h);
  void wake_unpinned(std::span<const ClothBody> near);
  void answer_cloths(std::span<const ClothBody> near, Real start, Real h);
  void hit_cloths(Real h);
  void report_cloths(StepReport& report);
  void detach_cloths(BodyHandle body);

  // Time is a base plus an integer number of equal sampling times, so that rounding errors do not add up.
  Real base_time = 0, sampling_time = 0;
  uint64_t samplings = 0, substeps = 0;
  Real now = 0;

  std::vector<MovedBody> moved;
  uint64_t born = 0, bodies_woken = 0, bodies_put_to_sleep = 0;  // since the last report

  // Lists of bodies by rank, rebuilt after a body was added or removed, fell asleep or woke.
  bool ranks_changed = false, lists_changed = true, pairs_changed = true, joints_changed = false;
  JointTally joint_tally;  // of the sub-step, without that of `motions`
  // Slots of bodies that do not collide with each other, because of a joint.
  std::vector<std::pair<uint32_t, uint32_t>> apart;
  std::vector<Body*> awake, kinematic;  // awake dynamic bodies; moving kinematic bodies
  std::vector<Body*> stepped;           // all bodies that may have moved in this step
  std::map<uint32_t, std::vector<Body*>> sleeping;
  uint32_t sleeping_groups = 0;  // number of groups so far
  std::size_t asleep = 0;        // number of sleeping bodies
  std::size_t watched = 0;       // number of springs of sleeping bodies whose other ends can move

  GroupedBroadPhase broad_phase;  // of the colliding bodies, by slot; articulations are groups
  ContactGraph graph;
  tbb::task_arena serial{1};
  std::vector<ContactPair*> active_pairs;  // pairs with a body that can move
  std::vector<Island> islands;
  std::map<uint32_t, SolverChoice> choices;  // by the slot of an island's first body
  ExactSolverBudget patience;
  FastContacts fast_contacts;
  std::vector<std::unique_ptr<CoupledSystem>> motions;  // of this sub-step

  std::vector<std::string> materials;  // names of materials; bodies have their numbers
  std::map<std::pair<uint32_t, uint32_t>, ContactRule> rules;

  // Obstacles of particles in the current sub-step. Those that cannot move are rebuilt only after a change
  // (E9).
  Obstacles fixed_obstacles, moving_obstacles;
  bool fixed_changed = true;
  bool has_lifetimes = false;  // whether any body, joint or cloth appears or is removed at a time
  bool prewarming = false;
  std::vector<ParticleSystemHandle> waiting;  // systems that are paused while others are prewarmed
  ParticleCollisions particle_collisions;
  BodyImpulses body_impulses;
  std::vector<BodyImpulses::Link> links;       // by slot, for bodies with joints
  std::vector<Articulation*> articulation_of;  // by slot, for bodies with joints
  std::vector<ParticleEvent> particle_events;  // of the last sub-step
  ClothSystem cloth_system;
  // Impulses too weak to wake the body, by its slot; they are summed.
  std::map<uint32_t, Reaction> pending_impulses;
};

}  // namespace offstage::sim
