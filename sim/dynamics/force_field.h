#pragma once
/// Forces on bodies beyond gravity, drag and springs (physics R2, E8, and the fields of P2): fields in a
/// region, wind, a scripted grab, an explosion. Plain definitions, and what they do to a body.

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "sim/dynamics/keyframes.h"
#include "sim/dynamics/rigid_body.h"
#include "sim/handle.h"
#include "sim/types.h"

namespace offstage::sim {

struct BodyTag;
using BodyHandle = Handle<BodyTag>;
struct ForceTag {};
using ForceHandle = Handle<ForceTag>;
struct Solid;

/// Where a field acts. Its strength there falls from 1 in the middle to 0 at the edge, to the power of the
/// field's drop rate; with drop rate 0 it is 1 throughout.
struct Everywhere {};
struct SphereRegion {
  Vec3 centre = Vec3::Zero();
  Real radius = 1;  ///< [m], > 0
};
/// Along the axes of the world. The strength is by the axis in which the point is nearest to the edge.
struct BoxRegion {
  Vec3 centre = Vec3::Zero();
  Vec3 size = Vec3::Ones();  ///< full edges [m], > 0
};
using Region = std::variant<Everywhere, SphereRegion, BoxRegion>;

/// 1 - |f|/R in a sphere, the least 1 - |f_i|/(b_i/2) in a box, to the power `drop_rate`; 0 outside.
Real strength(const Region& region, uint32_t drop_rate, const Vec3& point);

/// The same force on every body.
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

/// Moving air: viscous drag F = -k (v - wind), on top of the body's own drag.
struct WindField {
  Vec3 wind = Vec3::Zero();  ///< [m/s]
  Real drag = 0;             ///< k [kg/s], >= 0
  Region region;
  uint32_t drop_rate = 0;
};

/// A damped spring of no length between a point of the body and a keyframed point, as by a hand or a mouse: F
/// = -k d - c d'.
struct Grab {
  Vec3 point = Vec3::Zero();  ///< of the body, in its own frame
  KeyframeTrack track;        ///< of the hand; at least one key, whose orientations are not used
  Real stiffness = 100;       ///< k [N/m], >= 0
  Real damping = 10;          ///< c [N s/m], >= 0
};

/// A blow away from a point, at the force's start. It hits each body at its nearest point, so that it also
/// turns those that it does not hit square.
struct Explosion {
  Vec3 point = Vec3::Zero();
  Real impulse = 1;  ///< on a body right at the point [N s]
  Real radius = 1;   ///< no effect from here on [m], > 0
  uint32_t drop_rate = 1;
};

/// A force of the world.
struct ForceDef {
  std::string name;
  std::vector<BodyHandle> bodies;                    ///< what it acts on; empty: all dynamic bodies
  Real start = 0;                                    ///< [s]
  Real end = std::numeric_limits<Real>::infinity();  ///< [s]
  std::variant<ConstantField, PointField, WindField, Grab, Explosion> effect;

  bool is_on(Real time) const { return time >= start && time < end; }
  bool is_explosion() const { return std::holds_alternative<Explosion>(effect); }
  /// Whether it is an explosion that goes off in the time from `from` up to but without `to`.
  bool explodes(Real from, Real to) const { return is_explosion() && from <= start && start < to; }
};

/// What is wrong with a definition: the field, and what is allowed. Empty: nothing.
std::string problem(const ForceDef& def);

/// A force and a torque about the centre of mass, or an impulse and an angular impulse; world axes.
struct Wrench {
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
};

/// A body at a stage of an integration.
struct RigidMotion {
  Vec3 position;  ///< of the centre of mass
  Quat orientation;
  Vec3 velocity, angular_velocity;
};

/// The force on a body whose centre of mass is at `centre` in its frame. Fields act at the centre of mass.
/// Nothing when the force is not on, nor from an explosion.
Wrench wrench(const ForceDef& def, Real time, const RigidMotion& motion, const Vec3& centre);

/// The impulse of an explosion on a placed solid with its centre of mass at `centre` (world), acting there
/// with the angular impulse beside it.
Wrench impulse(const Explosion& explosion, const Solid& solid, const Pose& pose, const Vec3& centre);

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
