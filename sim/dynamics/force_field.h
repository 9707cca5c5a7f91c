#pragma once
/// Forces on bodies and particles besides gravity, drag and springs (physics P2, R2, E8): fields in a region,
/// moving air, a scripted grab, an explosion, forces between particles. This file has the definitions and the
/// forces on a body; the forces on particles are in particle_forces.h and pair_forces.h.

#include <cstdint>
#include <limits>
#include <optional>
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

/// A force that is the same on every body and particle.
struct ConstantField {
  Vec3 force = Vec3::Zero();  ///< [N]
  Region region;
  uint32_t drop_rate = 0;
};

/// A force towards a point; zero at the point itself.
struct PointField {
  Vec3 point = Vec3::Zero();
  Real force = 0;  ///< [N]; negative: away from the point
  Region region;
  uint32_t drop_rate = 0;
};

/// Moving air: viscous drag F = k (wind - v), in addition to the object's own drag -k_own v. With k = 0 the
/// force is k_own wind instead, so that the own drag acts relative to the air.
struct WindField {
  Vec3 wind = Vec3::Zero();  ///< [m/s]
  Real drag = 0;             ///< k [kg/s], >= 0
  Region region;
  uint32_t drop_rate = 0;
};

/// Air that rotates about an axis. At the distance r its speed is Gamma r / (2 pi (r^2 + R^2)): a free vortex
/// outside, and nearly a rigid rotation near the axis. It has no divergence.
struct Vortex {
  Vec3 point = Vec3::Zero();  ///< a point of the axis
  Vec3 axis = Vec3::UnitY();  ///< direction of the axis (any length except 0); the rotation is right-handed
  /// Circulation Gamma at a large distance [m^2/s]; the speed at the radius is Gamma / (4 pi R).
  Real circulation = 1;
  Real radius = 0.1;  ///< R, the distance of the greatest speed [m], > 0
  Real drag = 0;      ///< drag coefficient k; see WindField::drag [kg/s]
  Region region;
  uint32_t drop_rate = 0;
};
/// Velocity of the air at a point, without regard to the region [m/s].
Vec3 velocity(const Vortex& vortex, const Vec3& point);

/// A damped spring of rest length 0, F = -k d - c d', between a keyframed point (a hand or a mouse) and a
/// point of a body, or each particle of the systems.
struct Grab {
  Vec3 point = Vec3::Zero();  ///< point of the body, in its own frame
  KeyframeTrack track;        ///< motion of the hand; at least one key; orientations are not used
  Real stiffness = 100;       ///< k [N/m], >= 0
  Real damping = 10;          ///< c [N s/m], >= 0
  /// Particles farther than this from the hand are not affected [m], > 0.
  Real reach = std::numeric_limits<Real>::infinity();
};

/// A force at a point of a body and a torque, both given over time. It acts only on the bodies in
/// ForceDef::bodies.
struct AppliedForce {
  struct Key {
    Real time = 0;                                        ///< [s]
    Vec3 force = Vec3::Zero();                            ///< [N]
    Vec3 torque = Vec3::Zero();                           ///< [N m]
    Interpolation interpolation = Interpolation::linear;  ///< interpolation to the next key
  };
  /// At least one key, with strictly increasing times. Before the first key and after the last one, force and
  /// torque are constant.
  std::vector<Key> keys;
  /// Point of application in the body's frame [m]; default: the centre of mass.
  std::optional<Vec3> point = {};
  bool body_axes = false;  ///< whether force and torque are in the body's axes, not in the world's
};

/// An impulse away from a point, at the time ForceDef::start. It acts on a body at the body's nearest point,
/// so it may also make the body spin.
struct Explosion {
  Vec3 point = Vec3::Zero();
  Real impulse = 1;  ///< impulse on a body or a particle at the point of the explosion [N s]
  Real radius = 1;   ///< distance from which on there is no effect [m], > 0
  uint32_t drop_rate = 1;
};

/// Definition of a force of the world.
struct ForceDef {
  using Effect = std::variant<ConstantField, PointField, WindField, Grab, Explosion, Vortex, Turbulence,
                              MutualGravitation, Coulomb, LennardJones, AppliedForce>;

  std::string name;
  /// The objects on which the force acts. If none is named: all dynamic bodies and all cloths, no particles.
  std::vector<BodyHandle> bodies;
  std::vector<ParticleSystemHandle> systems;
  /// Moving air acts on the triangles of cloths. Every other force, and the drag of moving air with k > 0, is
  /// computed for the whole cloth and distributed over its points by their mass.
  std::vector<ClothHandle> cloths;
  Real start = 0;                                    ///< [s]
  Real end = std::numeric_limits<Real>::infinity();  ///< [s]
  Effect effect;

  bool acts_on(BodyHandle body) const;
  bool acts_on(ParticleSystemHandle system) const;
  bool acts_on(ClothHandle cloth) const;
  bool is_unrestricted() const { return bodies.empty() && systems.empty() && cloths.empty(); }
  bool is_on(Real time) const { return time >= start && time < end; }
  bool is_explosion() const { return std::holds_alternative<Explosion>(effect); }
  /// Whether this is a force between particles.
  bool is_pairwise() const;
  /// Whether the effect of this force on a body at rest can change with time.
  bool changes() const;
  /// Whether this force is an explosion whose time is in [from, to).
  bool explodes(Real from, Real to) const { return is_explosion() && from <= start && start < to; }
};

/// Returns an error message with the field and the allowed values; empty if the definition is valid.
std::string problem(const ForceDef& def);

/// A body at a stage of an integration.
struct RigidMotion {
  Vec3 position;  ///< position of the centre of mass
  Quat orientation;
  Vec3 velocity, angular_velocity;
};

/// Returns the force and torque on a body. `centre`: centre of mass in the body's frame [m]; `linear_drag`:
/// the body's own drag coefficient [kg/s]. Fields act at the centre of mass. Returns zero if the force is not
/// active at `time`, and for an explosion.
Wrench wrench(const ForceDef& def, Real time, const RigidMotion& motion, const Vec3& centre,
              Real linear_drag = 0);
/// Does the same, whether or not the force is active at `time`.
Wrench effect_wrench(const ForceDef& def, Real time, const RigidMotion& motion, const Vec3& centre,
                     Real linear_drag = 0);

/// Returns the impulse of an explosion on a solid [N s], and the angular impulse about its centre of mass
/// `centre` (world) [N m s].
Wrench impulse(const Explosion& explosion, const Solid& solid, const Pose& pose, const Vec3& centre);
/// Returns the impulse of an explosion on a particle at a point [N s].
Vec3 impulse(const Explosion& explosion, const Vec3& point);

/// Returns the force of moving air [N]. `drag`: coefficient of the field; `own`: drag coefficient of the
/// object (see WindField) [kg/s].
inline Vec3 air_drag(Real drag, Real own, const Vec3& air, const Vec3& velocity) {
  return drag > 0 ? Vec3(drag * (air - velocity)) : Vec3(own * air);
}

/// A force that acts in the current sub-step, with its bodies.
struct ActiveForce {
  const ForceDef* def;
  std::vector<const RigidBody*> only;  ///< sorted by address; used if the definition names any body

  bool acts_on(const RigidBody& body) const;
};

}  // namespace offstage::sim
