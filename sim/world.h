#pragma once
/// The simulation's front door: objects go in as plain definitions, step() advances them by a sampling time,
/// and moved() says where they went. The world knows nothing of drawing (physics E1-E5, E8, E9).
///
/// Valid ranges: sizes 0.001-100 m, speeds under 300 m/s. The state after step() is the same bits for any
/// number of threads.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "sim/articulation/joint.h"
#include "sim/cloth/cloth.h"
#include "sim/contact/collision.h"
#include "sim/core/handle.h"
#include "sim/core/non_finite.h"
#include "sim/core/types.h"
#include "sim/dynamics/body_def.h"
#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"
#include "sim/dynamics/keyframes.h"
#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/mesh.h"
#include "sim/geometry/shape.h"
#include "sim/particles/particles.h"

namespace offstage::sim {

class CollisionMesh;

/// Where a spring ends: a point of the world, a point of a body (body frame), or a particle by its id.
struct WorldPoint {
  Vec3 position = Vec3::Zero();
};
struct BodyPoint {
  BodyHandle body;
  Vec3 position = Vec3::Zero();
};
struct ParticlePoint {
  ParticleSystemHandle system;
  uint64_t id = 0;
};
using Attachment = std::variant<WorldPoint, BodyPoint, ParticlePoint>;

/// Damped spring between two points (P2, R2): F = -[k (|d| - L) + c (d'.d)/|d|] d/|d|. A spring whose
/// particle died is removed with it.
struct SpringDef {
  std::string name;
  Attachment a, b;
  Real stiffness = 100;   ///< k [N/m], >= 0
  Real damping = 0;       ///< c [N s/m], >= 0
  Real rest_length = -1;  ///< L [m]; negative: the distance at creation
};

/// What two materials do to each other, in place of what would follow from each (see BodyDef).
struct ContactRule {
  std::string a, b;  ///< materials, in any order
  std::optional<Real> restitution, friction, static_friction;
};

/// How resting contact is computed (physics N11, N12).
enum class SolverKind {
  exact,  ///< collisions at their very times, contact forces to rounding: slow where hundreds of bodies pile
          ///< up
  fast,   ///< time stepping on velocities: a bounded amount of work, errors far below a millimetre
  automatic,  ///< exact where it costs less than fast or the group is small, by the work of steps before
};

struct WorldDef {
  Vec3 gravity = {0, -9.81, 0};                     ///< [m/s^2]
  Vec3 wind = Vec3::Zero();                         ///< air velocity felt by drag [m/s]
  Real max_step = 1.0 / 240;                        ///< longest internal step [s]
  IntegratorKind integrator = IntegratorKind::rk4;  ///< of bodies and of everything joined by springs
  Real integration_error = 1e-6;  ///< per step, of the adaptive integrators: of any coordinate [m]
  SolverKind solver = SolverKind::automatic;
  ImpactLaw impact = ImpactLaw::simultaneous;
  Real collision_speed = 0.05;  ///< bodies that meet slower than this do not bounce [m/s], > 0
  bool sleep = true;            ///< groups of bodies at rest are left alone until something happens to them
  Aabb bounds =
      Aabb(Vec3::Constant(-1000), Vec3::Constant(1000));  ///< what leaves is retired and reported (E3)
};

/// Two bodies whose contact forces are approximate: of a group of contacts that the solver meant for it did
/// not solve, the pair with the greatest error.
struct RoughContact {
  BodyHandle a, b;
};

/// What a step did. Numerical trouble is data here, never an exception.
struct StepReport {
  uint32_t substeps = 0;
  uint64_t particles_born = 0;
  uint64_t particles_expired = 0;  ///< reached their lifespan or died on a hit
  uint64_t particles_retired = 0;  ///< left the world's bounds
  uint64_t particles_ejected = 0;  ///< found inside a body and projected out (P4)
  uint64_t particles_removed = 0;  ///< found inside a body and could not be projected out (P4)
  uint64_t particle_collisions = 0;
  uint64_t truncated_sweeps = 0;  ///< particles that used up their bounded number of hits within one sub-step
  std::vector<BodyHandle> bodies_retired;  ///< left the world's bounds: frozen from here on

  // Contacts of bodies. Counts of the last sub-step, others of all.
  uint32_t bodies_awake = 0, bodies_asleep = 0;
  uint32_t islands = 0;     ///< groups of bodies that touch, or are joined
  uint32_t contacts = 0;    ///< points that touch
  Real penetration = 0;     ///< greatest at the starts of sub-steps and at impacts [m]
  uint64_t collisions = 0;  ///< contacts that met faster than WorldDef::collision_speed
  uint64_t tracebacks = 0;  ///< times that bodies were put back to a time of impact
  uint64_t toi_limit_reached =
      0;  ///< pairs that were not traced back any more in a sub-step: too many impacts
  uint64_t restitution_suppressed =
      0;                              ///< pairs in a pile that were too many to bounce any more in a sub-step
  uint64_t speculative_contacts = 0;  ///< contacts of the fast solver expected at a step's end
  uint64_t bodies_woken = 0, bodies_put_to_sleep = 0;
  ContactWork exact, fast;                   ///< of the solvers of resting contact
  ContactWork impacts;                       ///< of the solver of collisions
  std::vector<RoughContact> rough_contacts;  ///< one for each fall-back of these, in their order
  IntegratorReport integration;              ///< of the free motion

  Real joint_error = 0;  ///< greatest that was left of a joint's constraint at the end of a motion [m], [rad]
  uint64_t joints_unsolved = 0;            ///< times that joints could not be put back together
  std::vector<JointHandle> joints_broken;  ///< by too great a force, in this step

  uint64_t cloth_contacts = 0;  ///< at the end, of all cloths; the others as ClothReport has them
  uint64_t cloth_self_contacts = 0;
  uint64_t cloth_springs_clamped = 0;  ///< at the end, too
  Real cloth_strain = 0;               ///< greatest
  Real cloth_penetration = 0;          ///< deepest [m]
  uint64_t cloth_moves_limited = 0, cloth_moves_held_back = 0, cloth_crossings = 0, cloth_springs_torn = 0;
  uint64_t cloth_unconverged = 0;

  bool finite = true;    ///< false: something became NaN or infinite
  NonFinite non_finite;  ///< the first such object, if not finite
};

/// Mechanical energy [J]: kinetic, gravitational (zero at y = 0) with that of the forces between particles
/// (zero far out), and elastic.
struct Energy {
  Real kinetic = 0, potential = 0, elastic = 0;
  Real total() const { return kinetic + potential + elastic; }
};

/// A point where two bodies touch.
struct ContactState {
  BodyHandle a, b;
  Vec3 point = Vec3::Zero();   ///< between both surfaces, world [m]
  Vec3 normal = Vec3::Zero();  ///< from b to a
  /// On a: the mean over the last sub-step, or what an impact has left of it, friction included [N].
  Vec3 force = Vec3::Zero();
  Real separation = 0;  ///< [m], negative in penetration
};

/// Two bodies that collide with each other and are in each other.
struct BodyOverlap {
  BodyHandle a, b;
  Real depth;  ///< [m]
};

struct MovedBody {
  BodyHandle body;
  Pose pose;
};

/// Everything that can be asked of a body.
struct BodyState {
  Pose pose;              ///< of the body's own frame, as given at creation
  Vec3 centre;            ///< of mass, world [m]
  Vec3 velocity;          ///< of the centre of mass [m/s]
  Vec3 angular_velocity;  ///< world [rad/s]
  Vec3 angular_momentum;  ///< about the centre of mass, world [kg m^2/s]
  Real mass = 0;          ///< [kg]; 0 unless dynamic
};

/// 128 bits over the whole state: equal states have equal hashes.
struct StateHash {
  uint64_t low = 0, high = 0;
  friend bool operator==(const StateHash&, const StateHash&) = default;
  std::string hex() const;  ///< 32 lower-case digits, high word first
};

class World {
 public:
  explicit World(const WorldDef& def = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Registers a mesh: welds it, then computes topology, mass properties, hull and bounding tree once (E2).
  /// The convex decomposition, which is slow, is made when a body first needs it, unless the one that
  /// decompose() made of the welded mesh is given. Throws std::invalid_argument for an index out of range, a
  /// non-finite vertex or no face at all.
  MeshHandle add_mesh(const TriangleMesh& mesh, std::optional<ConvexDecomposition> decomposition = {});
  const MeshTopology& topology(MeshHandle mesh) const;
  const TriangleMesh& mesh(MeshHandle mesh) const;  ///< as registered (welded)
  const CollisionMesh& collision_mesh(MeshHandle mesh) const;

  /// Throws std::invalid_argument, saying which field and what is allowed, for a size, mass or density out of
  /// range; a dynamic body needs a solid: a plane or an open or inverted mesh is refused.
  BodyHandle add_body(const BodyDef& def);
  ParticleSystemHandle add_particle_system(const ParticleSystemDef& def);
  SpringHandle add_spring(const SpringDef& def);
  /// Throws std::invalid_argument for bodies of which none is dynamic, and for fields out of range.
  JointHandle add_joint(const JointDef& def);
  ClothHandle add_cloth(const ClothDef& def);
  ForceHandle add_force(const ForceDef& def);
  /// Of two rules for the same materials the later counts.
  void add_contact_rule(const ContactRule& rule);

  bool remove(BodyHandle body);  ///< springs and joints at it go too; false if the handle is stale
  bool remove(ParticleSystemHandle system);
  bool remove(SpringHandle spring);
  bool remove(JointHandle joint);
  bool remove(ClothHandle cloth);
  bool remove(ForceHandle force);

  /// Gives a dynamic body another velocity of its centre of mass [m/s] and angular velocity [rad/s].
  void set_velocity(BodyHandle body, const Vec3& velocity, const Vec3& angular_velocity);

  /// Adds a particle. `elapsed` is how long before the end of the coming sub-step it was born: it is
  /// integrated over just that part of it, and freely, through bodies, over what is longer. Negative: it
  /// exists now and is stepped in full. Returns its id.
  uint64_t add_particle(ParticleSystemHandle system, const Particle& particle, Real elapsed = -1);

  /// Called before each sub-step with its start and end time; emitters add their particles here.
  using BeforeSubStep = std::function<void(Real start, Real end)>;

  /// Lets particles alone live from one time up to another, in sub-steps as step() has them, before the first
  /// step(): from <= to <= 0 [s], and a further call goes on where the last one ended. time() is then `to`.
  /// Particles collide with each other and with bodies. Dynamic bodies, cloths, springs and the particles
  /// that were there before stand still, kinematic bodies follow their tracks, forces are those of time 0,
  /// and forces between particles do not act. With from = to = 0, `before` is called once, and particles born
  /// at that time exist from then on. Throws std::invalid_argument for other times.
  StepReport prewarm(Real from, Real to, const BeforeSubStep& before = {});

  /// Advances by `sampling_time` in the fewest equal sub-steps not longer than WorldDef::max_step.
  StepReport step(Real sampling_time, const BeforeSubStep& before = {});

  /// Time since the start [s]; negative between calls of prewarm().
  Real time() const;
  const WorldDef& def() const;

  /// Bodies whose pose changed during the last step (E5), in slot order.
  std::span<const MovedBody> moved() const;
  BodyState body(BodyHandle body) const;
  const BodyDef& body_def(BodyHandle body) const;
  /// Motion of a point of a body (world position at its current pose) at a time inside the current sub-step:
  /// exact for kinematic bodies, extrapolated for dynamic ones.
  Motion body_motion(BodyHandle body, Real time) const;
  JointState joint(JointHandle joint) const;  ///< of one that broke: as it was then
  const JointDef& joint_def(JointHandle joint) const;
  void for_each_joint(const std::function<void(JointHandle)>& f) const;
  const ParticleArrays& particles(ParticleSystemHandle system) const;
  const ParticleSystemDef& particle_system_def(ParticleSystemHandle system) const;
  /// What happened to the particles of systems that report it, in the last sub-step; in the order of system
  /// and id, of one particle in the order of time.
  std::span<const ParticleEvent> particle_events() const;
  ClothView cloth(ClothHandle cloth) const;
  const ClothDef& cloth_def(ClothHandle cloth) const;
  const ClothReport& cloth_report(ClothHandle cloth) const;  ///< of the last step
  void for_each_cloth(const std::function<void(ClothHandle)>& f) const;
  std::size_t cloth_count() const;
  void for_each_body(const std::function<void(BodyHandle)>& f) const;
  void for_each_particle_system(const std::function<void(ParticleSystemHandle)>& f) const;
  /// The contact points at the end of the last step, in the order of their bodies.
  std::vector<ContactState> contacts() const;
  /// Bodies that overlap where they are now by more than `least` [m], > 0, in the order of slots; `a` is
  /// dynamic. What begins so is pushed apart.
  std::vector<BodyOverlap> overlaps(Real least) const;
  /// The group of touching bodies that a body belongs to, numbered in the order of their first bodies; none
  /// for fixed and kinematic bodies.
  std::optional<uint32_t> island(BodyHandle body) const;
  bool is_asleep(BodyHandle body) const;
  std::size_t body_count() const;
  std::size_t particle_count() const;

  Energy energy() const;
  StateHash state_hash() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace offstage::sim
