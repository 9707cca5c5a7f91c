#pragma once
/// Contact-free motion of bodies, and of particles that have springs or pair forces (physics E6, R1, R2, P2).
/// A body without springs and joints moves alone; connected objects are integrated together. The motion of an
/// object does not depend on unconnected objects.

#include <vector>

#include "sim/world/coupled_group.h"

namespace offstage::sim {

class CoupledSystem {
 public:
  /// Contains all dynamic bodies, and all particle systems with springs or with forces between particles. No
  /// object may be added to the world or removed from it during its lifetime.
  explicit CoupledSystem(WorldState& world, std::span<const ForceDef* const> forces = {});
  /// Contains the given bodies, with their springs, joints and forces, for the rest of a sub-step that a
  /// CoupledSystem of all objects has begun. `bodies` must include all bodies that are connected() to one of
  /// them.
  CoupledSystem(WorldState& world, std::span<Body* const> bodies,
                std::span<const ForceDef* const> forces = {});

  CoupledSystem(const CoupledSystem&) = delete;
  CoupledSystem& operator=(const CoupledSystem&) = delete;

  /// Whether a particle system is integrated by this object.
  bool holds(const ParticleSystem& system) const;

  /// Advances all members from time t to t + h [s]. `tolerance`: largest error per step of the adaptive
  /// integrators [m].
  void step(const Integrator& integrator, Real t, Real h, Real tolerance = IntegratorWorkspace{}.tolerance);

  /// Stores the state of all members.
  void save();
  /// Returns the given bodies, and the objects connected to them, to their state at the last save(). Without
  /// an argument, it restores all members.
  void restore(std::span<Body* const> bodies);
  void restore();

  /// Statistics of all steps so far.
  const IntegratorReport& report() const { return report_; }
  /// Residuals of joints in all steps so far.
  JointFigures joint_figures() const;

 private:
  void resolve(const WorldState& world, std::span<const ForceDef* const> forces);
  void gather(WorldState& world, std::span<Body* const> bodies, bool all_systems);
  void for_each_held_body(const auto& use) const;
  void fly_uncoupled(const Integrator& integrator, Real t, Real h, Real tolerance);

  bool begins_substep_;
  std::vector<ActiveForce> active_;
  BodyForces forces_;
  std::vector<Body*> lone_;
  std::vector<CoupledGroup> networks_;
  std::vector<RigidState> kept_;                                 // states of the single bodies
  std::vector<std::pair<const Body*, std::size_t>> lone_index_;  // by address; created when first needed
  IntegratorReport report_;
};

}  // namespace offstage::sim
