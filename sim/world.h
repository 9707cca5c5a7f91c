#pragma once
/// Public interface of the simulation. Objects are added as plain definitions, step() advances them by a
/// sampling time, and moved() returns their new poses. The world does not depend on rendering (physics E1-E5,
/// E8, E9).
///
/// Valid ranges: sizes 0.001-100 m, speeds under 300 m/s. The state after step() is bitwise identical for any
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
#include "sim/collision/grid.h"
#include "sim/collision/tree_split.h"
#include "sim/contact/collision.h"
#include "sim/core/handle.h"
#include "sim/core/types.h"
#include "sim/dynamics/body_def.h"
#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"
#include "sim/dynamics/keyframes.h"
#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/mesh.h"
#include "sim/geometry/shape.h"
#include "sim/geometry/solid_mesh.h"
#include "sim/particles/particles.h"
#include "sim/step_report.h"

namespace offstage::sim {

class CollisionMesh;

/// The ends of a spring: a point of the world, a point of a body (in its frame), or a particle given by its
/// id.
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

/// Damped spring between two points (P2, R2): F = -[k (|d| - L) + c (d'.d)/|d|] d/|d|. A spring attached to a
/// particle is removed when the particle dies.
struct SpringDef {
  std::string name;
  Attachment a, b;
  Real stiffness = 100;   ///< k [N/m], >= 0
  Real damping = 0;       ///< c [N s/m], >= 0
  Real rest_length = -1;  ///< L [m]; negative: the distance at creation
};

/// Contact parameters for a pair of materials. They replace the values that are combined from the two bodies
/// (see BodyDef).
struct ContactRule {
  std::string a, b;  ///< materials, in any order
  std::optional<Real> restitution, friction, static_friction;
  std::optional<Real> rolling_friction = {}, spinning_friction = {};
};

/// Solver for resting contact (physics N11, N12).
enum class SolverKind {
  /// Resolves each collision at its own time, and computes contact forces to rounding. Slow for piles of
  /// hundreds of bodies.
  exact,
  /// Time stepping on velocities: a bounded amount of work, with errors far below a millimetre.
  fast,
  /// Uses `exact` for small islands and where it costs less than `fast`, judged by the work of previous
  /// steps.
  automatic,
  /// Computes contact forces by Dantzig's and Baraff's pivoting, with separate limits of friction along both
  /// tangents (N9, N10); otherwise as `exact`. Islands that pivoting does not solve are given to the exact
  /// solver and counted as fall-backs.
  lcp,
};

/// Solver for the contact forces of particles (physics P7).
enum class ParticleContactMethod : uint8_t {
  /// Solves the contacts of all particles by Gauss-Seidel sweeps, with bounded work.
  relaxation,
  /// Solves clusters of at most WorldDef::particle_cluster contacts by Dantzig's and Baraff's pivoting. Other
  /// clusters, and those that pivoting does not solve, are left to relaxation and counted.
  lcp
};

/// Algorithms of collision detection. They differ in their cost, and give the same results within their
/// tolerances, with one exception: bisection misses bodies that pass through each other within a sub-step.
struct CollisionMethods {
  /// Kind of the bounding volumes in the trees over the parts and triangles of meshes (physics H1-H3).
  /// `mixed` uses spheres for dynamic bodies and axis-aligned boxes for the others; a sphere is then tested
  /// against a box.
  enum class Trees : uint8_t { aabb, obb, sphere, mixed };
  /// Pieces of two meshes between which the time of impact is searched: convex parts, or triangles (book,
  /// section 2.4; physics R3). Contact points are always computed between the convex parts.
  enum class MeshPairs : uint8_t { parts, triangles };
  /// Algorithm for the distance of convex polyhedra: GJK or V-Clip (physics R4). Round shapes always use GJK.
  enum class NarrowPhase : uint8_t { gjk, vclip };
  /// Grid that finds overlapping bounding boxes: cells of several sizes, or one size for all objects (physics
  /// H5, H6).
  enum class BroadPhase : uint8_t { multi_grid, grid };
  /// Search for the time of impact: conservative advancement, or bisection of the sub-step (book, section
  /// 1.4.3; physics R12).
  enum class ImpactTime : uint8_t { advancement, bisection };
  NarrowPhase narrow_phase = NarrowPhase::gjk;
  BroadPhase broad_phase = BroadPhase::multi_grid;
  ImpactTime impact_time = ImpactTime::advancement;
  Trees trees = Trees::aabb;
  TreeSplit tree_split = TreeSplit::surface_area;  ///< rule by which the trees are split
  MeshPairs mesh_pairs = MeshPairs::parts;
  /// Width of a cell of the uniform grid in mean diameters of the bodies (the book's k), > 0.
  Real cell_factor = CellSizes::kMeansInCell;
};

struct WorldDef {
  Vec3 gravity = {0, -9.81, 0};  ///< [m/s^2]
  Vec3 wind = Vec3::Zero();      ///< velocity of the air, for drag [m/s]
  Real max_step = 1.0 / 240;     ///< longest sub-step [s]
  /// Integrator of bodies and of all objects connected by springs.
  IntegratorKind integrator = IntegratorKind::rk4;
  Real integration_error = 1e-6;  ///< largest error of a coordinate per step of the adaptive integrators [m]
  SolverKind solver = SolverKind::automatic;
  ImpactLaw impact = ImpactLaw::simultaneous;
  Real collision_speed = 0.05;  ///< bodies that approach more slowly do not bounce [m/s], > 0
  CollisionMethods collision = {};
  ParticleContactMethod particle_contacts = ParticleContactMethod::relaxation;
  uint32_t particle_cluster = 24;  ///< greatest number of contacts of a cluster solved by `lcp`, 1 to 64
  bool sleep = true;               ///< whether islands at rest are not simulated until something reaches them
  Aabb bounds = Aabb(Vec3::Constant(-1000),
                     Vec3::Constant(1000));  ///< objects that leave are retired and reported (E3)
};

/// Mechanical energy [J]: kinetic, potential and elastic. The potential energy is the sum of the energies of
/// gravity (zero at y = 0) and of the forces between particles (zero at infinity).
struct Energy {
  Real kinetic = 0, potential = 0, elastic = 0;
  Real total() const { return kinetic + potential + elastic; }
};

/// A contact point of two bodies at the end of the last step.
struct ContactState {
  BodyHandle a, b;
  Vec3 point = Vec3::Zero();   ///< contact point in the middle between both surfaces, world [m]
  Vec3 normal = Vec3::Zero();  ///< unit normal from b to a
  /// Force on a, friction included: the mean over the last sub-step, or over the part of it after the last
  /// impact [N].
  Vec3 force = Vec3::Zero();
  Real separation = 0;  ///< [m], negative in penetration
};

/// Two bodies that collide with each other and overlap.
struct BodyOverlap {
  BodyHandle a, b;
  Real depth;  ///< [m]
};

struct MovedBody {
  BodyHandle body;
  Pose pose;
};

/// Current state of a body.
struct BodyState {
  Pose pose;              ///< pose of the body's frame, in which its shape was given
  Vec3 centre;            ///< centre of mass, world [m]
  Vec3 velocity;          ///< velocity of the centre of mass [m/s]
  Vec3 angular_velocity;  ///< world [rad/s]
  Vec3 angular_momentum;  ///< angular momentum about the centre of mass, world axes [kg m^2/s]
  Real mass = 0;          ///< [kg]; 0 unless dynamic
};

/// 128-bit hash of the whole state. Equal states have equal hashes.
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
  /// `decomposition` is the result of decompose() for the welded mesh; if it is not given, it is computed
  /// when a body first needs it, which is slow. Throws std::invalid_argument for an index out of range, a
  /// non-finite vertex or a mesh without faces.
  MeshHandle add_mesh(const TriangleMesh& mesh, std::optional<ConvexDecomposition> decomposition = {});
  /// Registers a compound of solids. Their vertices are in the frame of the compound, and solids may overlap.
  /// Bodies of this shape collide with the convex parts of all solids. The mass of a MeshShape that uses the
  /// compound assumes one density and counts overlaps twice; for several densities, pass the result of
  /// sum_of() to BodyDef. Throws std::invalid_argument for an empty list and for the errors of add_mesh().
  MeshHandle add_compound(const std::vector<SolidMesh>& solids);
  /// Registers a mesh of another world. Both worlds share the mesh and its derived data; nothing is computed
  /// again. Throws std::invalid_argument for null.
  MeshHandle add_shared_mesh(std::shared_ptr<const CollisionMesh> mesh);
  std::shared_ptr<const CollisionMesh> shared_mesh(MeshHandle mesh) const;
  const MeshTopology& topology(MeshHandle mesh) const;
  const TriangleMesh& mesh(MeshHandle mesh) const;  ///< the registered mesh, after welding
  const CollisionMesh& collision_mesh(MeshHandle mesh) const;

  /// Adds a body. Throws std::invalid_argument, naming the field and its allowed values, for a size, mass or
  /// density out of range, and for a dynamic body whose shape is a plane or an open or inverted mesh.
  BodyHandle add_body(const BodyDef& def);
  ParticleSystemHandle add_particle_system(const ParticleSystemDef& def);
  SpringHandle add_spring(const SpringDef& def);
  /// Adds a joint. Throws std::invalid_argument if neither body is dynamic or a field is out of range.
  JointHandle add_joint(const JointDef& def);
  ClothHandle add_cloth(const ClothDef& def);
  ForceHandle add_force(const ForceDef& def);
  /// Adds a rule for a pair of materials. It replaces an earlier rule for the same pair.
  void add_contact_rule(const ContactRule& rule);

  /// Removes an object. Returns false if the handle is stale. The springs and joints of a removed body are
  /// removed, too.
  bool remove(BodyHandle body);
  bool remove(ParticleSystemHandle system);
  bool remove(SpringHandle spring);
  bool remove(JointHandle joint);
  bool remove(ClothHandle cloth);
  bool remove(ForceHandle force);

  /// Sets the velocity of a dynamic body's centre of mass [m/s] and its angular velocity [rad/s].
  void set_velocity(BodyHandle body, const Vec3& velocity, const Vec3& angular_velocity);

  /// Applies an impulse [N s] to a dynamic body at a point in world coordinates, and wakes the body. In the
  /// next sub-step, joints transmit the impulse to connected bodies.
  void add_impulse(BodyHandle body, const Vec3& impulse, const Vec3& point);

  /// Adds a particle and returns its id. `elapsed` is the time from its birth time to the end of the coming
  /// sub-step [s]; the particle is integrated over that part only. If `elapsed` is longer than the sub-step,
  /// the particle ignores bodies during the time before the sub-step. If it is negative, the particle exists
  /// now and is advanced through the whole sub-step.
  uint64_t add_particle(ParticleSystemHandle system, const Particle& particle, Real elapsed = -1);

  /// A function that is called before each sub-step with its start and end time. Emitters add their particles
  /// in this function.
  using BeforeSubStep = std::function<void(Real start, Real end)>;

  /// Advances only the particles, from time `from` to time `to` [s], before the first step(). The times must
  /// satisfy from <= to <= 0. A further call must start where the last one ended. The sub-steps are as long
  /// as in step(). Afterwards time() is `to`. Particles collide with each other, with bodies and with cloths.
  /// Dynamic bodies, cloths, springs and previously existing particles do not move. Kinematic bodies follow
  /// their tracks. Forces have their values at time 0, and forces between particles do not act. With from =
  /// to = 0, `before` is called once, and particles created at that time exist from then on. Throws
  /// std::invalid_argument for other times.
  StepReport prewarm(Real from, Real to, const BeforeSubStep& before = {});

  /// Advances by `sampling_time` [s] in the fewest equal sub-steps not longer than WorldDef::max_step. A
  /// sub-step in which a body would pass cloth and reach another body is divided into up to 32 parts.
  /// `before` is called for each part, and StepReport::substeps counts the parts.
  StepReport step(Real sampling_time, const BeforeSubStep& before = {});

  /// Time since the start of the simulation [s]. It is negative until prewarm() has reached time 0.
  Real time() const;
  const WorldDef& def() const;

  /// Bodies whose pose changed during the last step (E5), in slot order.
  std::span<const MovedBody> moved() const;
  /// Whether an object exists at this time; see BodyDef::appear_at and ClothDef::appear_at.
  bool is_present(BodyHandle body) const;
  bool is_present(ClothHandle cloth) const;
  BodyState body(BodyHandle body) const;
  const BodyDef& body_def(BodyHandle body) const;
  /// Motion of a point of a body (world position at its current pose) at a time inside the current sub-step:
  /// exact for kinematic bodies, extrapolated for dynamic bodies.
  Motion body_motion(BodyHandle body, Real time) const;
  JointState joint(JointHandle joint) const;  ///< a broken joint keeps the state in which it broke
  const JointDef& joint_def(JointHandle joint) const;
  void for_each_joint(const std::function<void(JointHandle)>& f) const;
  const ParticleArrays& particles(ParticleSystemHandle system) const;
  const ParticleSystemDef& particle_system_def(ParticleSystemHandle system) const;
  /// Events of the last sub-step, for the particle systems that report them. They are ordered by system, then
  /// by particle id, then by time.
  std::span<const ParticleEvent> particle_events() const;
  ClothView cloth(ClothHandle cloth) const;
  const ClothDef& cloth_def(ClothHandle cloth) const;
  const ClothReport& cloth_report(ClothHandle cloth) const;  ///< statistics of the cloth in the last step
  /// The gas inside of a cloth with `pressure` now; zero for other cloths.
  ClothGasState cloth_gas(ClothHandle cloth) const;
  void for_each_cloth(const std::function<void(ClothHandle)>& f) const;
  std::size_t cloth_count() const;
  void for_each_body(const std::function<void(BodyHandle)>& f) const;
  void for_each_particle_system(const std::function<void(ParticleSystemHandle)>& f) const;
  /// Contact points at the end of the last step, in the order of their bodies.
  std::vector<ContactState> contacts() const;
  /// Pairs of bodies that currently overlap by more than `least` [m], which must be > 0. Pairs are in the
  /// order of the bodies' slots. Body `a` of a pair is dynamic. The contact solvers push such bodies apart
  /// during the next steps.
  std::vector<BodyOverlap> overlaps(Real least) const;
  /// Index of the island that contains a body. Islands are numbered in the order of their first bodies. The
  /// result is empty for static and kinematic bodies.
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
