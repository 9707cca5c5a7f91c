#pragma once
/// Bodies and particles that are connected by springs, joints or forces between particles, as one dynamic
/// system (physics R1, R2, A1, P2).
///
/// Layout of the state: for each body x = [position 3, quaternion x y z w], p = [L 3, H 3]; then for each
/// particle x = position, p = velocity.

#include <unordered_map>
#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/dynamics/free_body.h"
#include "sim/dynamics/pair_forces.h"
#include "sim/world/world_state.h"

namespace offstage::sim {

/// The members of a group: the objects of one or more components of the CouplingGraph.
struct GroupMembers {
  std::vector<Body*> bodies;
  std::vector<ParticleSystem*> systems;
  std::vector<const Spring*> springs;
  std::vector<Articulation*> articulations;
};

class CoupledGroup final : public DynamicSystem {
 public:
  /// `forces` must outlive the group, and no object may be added to or removed from the world during its
  /// lifetime.
  CoupledGroup(const WorldState& world, GroupMembers members, const BodyForces& forces);

  std::span<Body* const> bodies() const { return bodies_; }
  bool holds(const ParticleSystem& system) const;

  /// Notifies the particle systems that a sub-step begins.
  void begin_substep() const;
  /// Advances the members from t to t + h. If only forces between particles connect them, the integrator of
  /// the first system is used.
  void step(const Integrator& integrator, Real t, Real h, IntegratorWorkspace& work);

  const JointFigures& joint_figures() const { return joint_figures_; }

  /// save() stores the state of the members; restore() returns to the state that was stored last.
  void save();
  void restore();

  void velocity(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dx) const override;
  void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const override;
  bool force_and_damping(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp,
                         std::span<Real> damping) const override;
  void jacobian(Real t, std::span<const Real> x, std::span<const Real> p,
                SparseEntries& entries) const override;

 private:
  struct Group {
    ParticleSystem* system;
    ParticleForces forces;
    std::vector<std::size_t> members;  // the particles that exist during the whole sub-step
    std::vector<Real> mass;            // masses of these particles
    std::size_t offset;                // index of the first of them in units of 3, after the bodies

    /// Returns the elements of this system's particles in an array over all particles of the coupled group,
    /// three numbers for each.
    template <class T>
    std::span<T> part(std::span<T> particles) const {
      return particles.subspan(3 * offset, 3 * members.size());
    }
  };
  /// An end of a spring, as a position in the state.
  struct End {
    enum class Kind { still, kinematic, dynamic, particle } kind = Kind::still;
    Vec3 point = Vec3::Zero();  // still: position in the world; dynamic: relative to the centre of mass, body
                                // axes; kinematic: in the frame of the body
    const Body* body = nullptr;
    std::size_t index = 0;  // index of the body or the particle in the state
    Real mass = 1;          // mass of the particle

    bool is_moved() const { return kind == Kind::dynamic || kind == Kind::particle; }
  };
  /// An articulation, with the indices of its links among the bodies.
  struct Jointed {
    Articulation* articulation;
    std::vector<std::size_t> links;
  };
  struct PointMotion {
    Vec3 position, velocity;
  };
  struct ActiveSpring {
    End a, b;
    Real stiffness, damping, rest_length;
  };
  /// The force of a spring at one time.
  struct Pull {
    Vec3 along = Vec3::Zero();  // from b to a; zero if the ends coincide, where the direction is undefined
    Real length = 0;
    Real size = 0;                 // force on a against `along`, and on b along it
    Vec3 velocity = Vec3::Zero();  // velocity of a relative to b
  };
  struct EndDerivative;
  using BodyIndex = std::unordered_map<const Body*, std::size_t>;

  std::size_t particle_x(std::size_t i) const { return kBodyX * bodies_.size() + 3 * i; }
  std::size_t particle_p(std::size_t i) const { return kBodyP * bodies_.size() + 3 * i; }
  RigidStage stage(std::size_t body, std::span<const Real> x, std::span<const Real> p) const {
    return {bodies_[body]->rigid, x.subspan(kBodyX * body, kBodyX), p.subspan(kBodyP * body, kBodyP)};
  }
  void add_articulation(Articulation& articulation, const BodyIndex& index);
  struct Links;
  Links links(const Jointed& jointed, std::span<const Real> x, std::span<const Real> p,
              std::span<const Real> dp) const;
  void add_joint_forces(const Jointed& jointed, Real t, std::span<const Real> x, std::span<const Real> p,
                        std::span<Real> dp) const;
  Stiffness stiffness(Real t) const;
  Real pieces(Real h, Real damping) const;
  Real kicks(Real h, Real damping) const;
  void kick(Real t, Real h, IntegratorWorkspace& work);
  /// Kinetic energy [J], power of all forces except joint forces [W], and a measure of these forces: the
  /// kinetic energy that they would give to free bodies from rest in a time t, divided by t^2 [J/s^2].
  struct EnergyRate {
    Real kinetic = 0, power = 0, from_rest = 0;
  };
  Real kinetic_energy() const;
  EnergyRate energy_rate(Real t, IntegratorWorkspace& work) const;
  void advance(const Integrator& integrator, Real t, Real h, int depth, int& halvings,
               IntegratorWorkspace& work);
  void limit_energy(Real most);
  void set_all_forces(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const;
  void set_free_forces(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const;
  void add_group(const WorldState& world, ParticleSystem& system);
  void add_pair_forces(const WorldState& world);
  void add_springs(const WorldState& world, std::span<const Spring* const> springs, const BodyIndex& index);
  End resolve(const WorldState& world, const Attachment& a, const BodyIndex& index) const;
  PointMotion motion(const End& end, Real t, std::span<const Real> x, std::span<const Real> p) const;
  Pull pull(const ActiveSpring& spring, Real t, std::span<const Real> x, std::span<const Real> p) const;
  void apply(const End& end, const Vec3& force, std::span<const Real> x, std::span<Real> dp) const;
  EndDerivative derivative(const End& end, const Vec3& force, std::span<const Real> x,
                           std::span<const Real> p) const;
  void add_derivatives(const ActiveSpring& spring, Real t, std::span<const Real> x, std::span<const Real> p,
                       SparseEntries& entries) const;
  void load(std::span<Real> x, std::span<Real> p) const;
  void store(std::span<const Real> x, std::span<const Real> p);

  const BodyForces& forces_;
  std::vector<Body*> bodies_;
  std::vector<Group> groups_;
  std::vector<ActiveSpring> springs_;
  std::vector<Jointed> articulations_;
  JointFigures joint_figures_;
  PairForces pair_forces_;
  std::size_t particles_ = 0;
  std::vector<Real> x_, p_, saved_x_, saved_p_, saved_steps_;
};

}  // namespace offstage::sim
