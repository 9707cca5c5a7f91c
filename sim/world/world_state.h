#pragma once
/// The objects of a world. The stages of a sub-step share them; data that a single stage keeps from sub-step
/// to sub-step is in the class of that stage.

#include <memory>
#include <vector>

#include "sim/articulation/articulation.h"
#include "sim/cloth/cloth_system.h"
#include "sim/core/handle.h"
#include "sim/dynamics/body.h"
#include "sim/particles/particle_system.h"
#include "sim/world.h"

namespace offstage::sim {

/// Values that may jump at the ends of a sub-step, as the velocities of keyframed bodies, are those at this
/// fraction of its length inside of it.
constexpr Real kInside = 1e-6;

struct Spring {
  SpringDef def;
  Real rest_length;
};

struct WorldState {
  WorldDef def;
  SlotMap<std::shared_ptr<const CollisionMesh>, MeshTag> meshes;  // other worlds may share them
  SlotMap<std::unique_ptr<Body>, BodyTag> bodies;
  SlotMap<ParticleSystem, ParticleSystemTag> systems;
  SlotMap<Spring, SpringTag> springs;
  SlotMap<ForceDef, ForceTag> force_defs;
  SlotMap<std::unique_ptr<Cloth>, ClothTag> cloths;
  SlotMap<std::unique_ptr<Joint>, JointTag> joints;
  std::vector<std::unique_ptr<Articulation>> articulations;  // the connected components of the intact joints

  Real substep_start = 0, substep_end = 0;  // the current sub-step [s]

  Body& body_at(uint32_t slot) const { return *bodies[bodies.at_slot(slot)]; }
  /// Whether each collision is resolved at its own time, and contacts are solved to rounding.
  bool is_exact() const { return def.solver == SolverKind::exact || def.solver == SolverKind::lcp; }
  /// Whether a force acts in the current sub-step: the whole sub-step or nothing, by the time of its middle.
  /// If the stages of an integrator decided for themselves, the last stage would miss a force that ends with
  /// the sub-step, and its impulse would be too small.
  bool acts(const ForceDef& force) const { return force.is_on((substep_start + substep_end) / 2); }
  std::vector<const ForceDef*> active_forces() const;
  /// The forces that act on each particle of a system independently of other particles.
  ParticleForces forces(const ParticleSystem& system) const;
  /// Whether there are forces between particles.
  bool has_pair_forces() const;
  /// Whether the object of an attachment exists.
  bool is_alive(const Attachment& a) const;
  /// Whether the objects at both ends of a spring currently exist.
  bool acts(const Spring& spring) const;
  Vec3 position(const Attachment& a) const;
};

}  // namespace offstage::sim
