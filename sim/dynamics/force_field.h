#pragma once
/// Forces on bodies and particles beyond gravity, drag and springs (physics P2, R2, E8): fields in a region,
/// moving air, a scripted grab, an explosion, forces between particles. Plain definitions, and what they do
/// to a body; what they do to particles is in particle_forces.h and pair_forces.h.

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "sim/core/handle.h"
#include "sim/core/twist.h"
#include "sim/core/types.h"
#include "sim/dynamics/keyframes.h"
#include "sim/dynamics/pair_law.h"
#include "sim/dynamics/region.h"
#include "sim/dynamics/rigid_body.h"
#include "sim/dynamics/turbulence.h"

namespace offstage::sim {

struct BodyTag;
using BodyHandle = Handle<BodyTag>;
struct ParticleSystemTag;
using ParticleSystemHandle = Handle<ParticleSystemTag>;
struct ClothTag;
using ClothHandle = Handle<ClothTag>;
struct ForceTag {};
using ForceHandle = Handle<ForceTag>;
struct Solid;

/// The same force on every body and particle.
struct ConstantField {
  Vec3 force = Vec3::Zero();  ///< [N]
  Region region;
  uint32_t drop_rate = 0;
};

/// A force towards a point; none exactly there.
struct PointField {
  Vec3 point = Vec3::Zero();
  Real force = 0;  ///< [N]; negative: away from the point
  Region region;
  uint32_t drop_rate = 0;
};

/// Moving air: viscous drag F = k (wind - v), on top of the object's own drag k_own. With k = 0 only the own
/// drag feels it, which the wind changes by k_own wind.
struct WindField {
  Vec3 wind = Vec3::Zero();  ///< [m/s]
  Real drag = 0;             ///< k [kg/s], >= 0
  Region region;
  uint32_t drop_rate = 0;
};

/// Air that turns about an axis: with the distance r from it at the speed Gamma r / (2 pi (r^2 + R^2)), which
/// is a free vortex outside and turns as a rigid body inside. It has no divergence.
struct Vortex {
  Vec3 point = Vec3::Zero();  ///< of the axis
  Vec3 axis = Vec3::UnitY();  ///< of any length but 0; right-handed
  Real circulation = 1;       ///< Gamma, far out [m^2/s]; at the radius the speed is Gamma / (4 pi R)
  Real radius = 0.1;          ///< R, where the air is fastest [m], > 0
  Real drag = 0;              ///< as WindField's [kg/s]
  Region region;
  uint32_t drop_rate = 0;
};
/// Of the air, without regard to the region [m/s].
Vec3 velocity(const Vortex& vortex, const Vec3& point);

/// A damped spring of no length between a point of a body, or every particle of the systems, and a keyframed
/// point, as by a hand or a mouse: F = -k d - c d'.
struct Grab {
  Vec3 point = Vec3::Zero();  ///< of the body, in its own frame
  KeyframeTrack track;        ///< of the hand; at least one key, whose orientations are not used
  Real stiffness = 100;       ///< k [N/m], >= 0
  Real damping = 10;          ///< c [N s/m], >= 0
  /// Particles farther than this from the hand are left alone [m], > 0.
  Real reach = std::numeric_limits<Real>::infinity();
};

/// An impulse away from a point, at the force's start. It hits each body at its nearest point, so that it
/// also turns those that it does not hit square.
struct Explosion {
  Vec3 point = Vec3::Zero();
  Real impulse = 1;  ///< on a body or a particle right at the point [N s]
  Real radius = 1;   ///< no effect from here on [m], > 0
  uint32_t drop_rate = 1;
};

/// A force of the world.
struct ForceDef {
  using Effect = std::variant<ConstantField, PointField, WindField, Grab, Explosion, Vortex, Turbulence,
                              MutualGravitation, Coulomb, LennardJones>;

  std::string name;
  /// What it acts on. If nothing is named: all dynamic bodies and all cloths, no particles.
  std::vector<BodyHandle> bodies;
  std::vector<ParticleSystemHandle> systems;
  /// Cloths feel moving air by their triangles; every other force, and the drag of one with k > 0, is that on
  /// a whole cloth, spread over its points by their mass.
  std::vector<ClothHandle> cloths;
  Real start = 0;                                    ///< [s]
  Real end = std::numeric_limits<Real>::infinity();  ///< [s]
  Effect effect;

  bool acts_on(BodyHandle body) const;
  bool acts_on(ParticleSystemHandle system) const;
  bool acts_on(ClothHandle cloth) const;
  bool names_nothing() const { return bodies.empty() && systems.empty() && cloths.empty(); }
  bool is_on(Real time) const { return time >= start && time < end; }
  bool is_explosion() const { return std::holds_alternative<Explosion>(effect); }
  /// Whether it is a force of particles on each other.
  bool is_pairwise() const;
  /// Whether what it does to a body at rest can be another thing at another time.
  bool changes() const;
  /// Whether it is an explosion that goes off in the time from `from` up to but without `to`.
  bool explodes(Real from, Real to) const { return is_explosion() && from <= start && start < to; }
};

/// What is wrong with a definition: the field, and what is allowed. Empty: nothing.
std::string problem(const ForceDef& def);

/// A body at a stage of an integration.
struct RigidMotion {
  Vec3 position;  ///< of the centre of mass
  Quat orientation;
  Vec3 velocity, angular_velocity;
};

/// The force on a body whose centre of mass is at `centre` in its frame and which has a `linear_drag` of its
/// own [kg/s]. Fields act at the centre of mass. Nothing when the force is not on, nor from an explosion.
Wrench wrench(const ForceDef& def, Real time, const RigidMotion& motion, const Vec3& centre,
              Real linear_drag = 0);

/// The impulse of an explosion on a placed solid with its centre of mass at `centre` (world), acting there
/// with the angular impulse beside it.
Wrench impulse(const Explosion& explosion, const Solid& solid, const Pose& pose, const Vec3& centre);
/// The same on a particle at a point.
Vec3 impulse(const Explosion& explosion, const Vec3& point);

/// Drag by air that moves: `drag` of the field, `own` of what is in it (see WindField).
inline Vec3 air_drag(Real drag, Real own, const Vec3& air, const Vec3& velocity) {
  return drag > 0 ? Vec3(drag * (air - velocity)) : Vec3(own * air);
}

/// A force whose bodies have been looked up.
struct ActiveForce {
  const ForceDef* def;
  std::vector<const RigidBody*> only;  ///< sorted by address; counts if the definition names any

  bool acts_on(const RigidBody& body) const;
  /// Whether it pulls at the body at any time from `from` to `to`.
  bool acts_on(const RigidBody& body, Real from, Real to) const {
    return !def->is_explosion() && def->start <= to && def->end > from && acts_on(body);
  }
};

}  // namespace offstage::sim
