#pragma once
/// The motion of bodies, and of the particles that springs hold on to or that act on each other, between
/// contacts (physics E6, R1, R2, P2): a body that no spring holds flies alone, what is joined is integrated
/// together. How an object moves does not depend on what else moves.

#include <vector>

#include "sim/world/coupled_group.h"

namespace offstage::sim {

class CoupledSystem {
 public:
  /// All dynamic bodies, and all particle systems that springs hold on to or whose particles act on others.
  /// The world must not gain or lose anything while this is in use.
  explicit CoupledSystem(WorldState& world, std::span<const ForceDef* const> forces = {});
  /// These bodies, and what joins them; for the rest of a sub-step that one of everything has begun. They
  /// must contain all that are connected() to them.
  CoupledSystem(WorldState& world, std::span<Body* const> bodies,
                std::span<const ForceDef* const> forces = {});

  CoupledSystem(const CoupledSystem&) = delete;
  CoupledSystem& operator=(const CoupledSystem&) = delete;

  /// Whether a particle system moves with this.
  bool holds(const ParticleSystem& system) const;

  /// Advances everything from t to t + h; `tolerance` is for adaptive integrators.
  void step(const Integrator& integrator, Real t, Real h, Real tolerance = IntegratorWorkspace{}.tolerance);

  /// Keeps the state of everything.
  void save();
  /// Takes bodies, with what is connected to them, back to where save() found them.
  void restore(std::span<Body* const> bodies);
  void restore();

  /// What all steps so far took.
  const IntegratorReport& report() const { return report_; }
  /// What was left of joints, of all steps so far.
  JointTally joint_tally() const;

 private:
  void resolve(const WorldState& world, std::span<const ForceDef* const> forces);
  void gather(WorldState& world, std::span<Body* const> bodies, bool all_systems);
  void fly_lone(const Integrator& integrator, Real t, Real h, Real tolerance);

  bool begins_substep_;
  std::vector<ActiveForce> active_;
  BodyForces forces_;
  std::vector<Body*> lone_;
  std::vector<CoupledGroup> networks_;
  std::vector<RigidState> kept_;                                 // of the lone bodies
  std::vector<std::pair<const Body*, std::size_t>> lone_index_;  // by address; made when first needed
  IntegratorReport report_;
};

}  // namespace offstage::sim
