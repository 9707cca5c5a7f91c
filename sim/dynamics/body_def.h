#pragma once
/// The definition of a body: the properties with which it is created.

#include <optional>
#include <string>

#include "sim/core/handle.h"
#include "sim/core/types.h"
#include "sim/dynamics/keyframes.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

struct BodyTag {};
struct SpringTag {};
using BodyHandle = Handle<BodyTag>;
using SpringHandle = Handle<SpringTag>;

enum class MotionType {
  static_body,  ///< never moves, costs no time in a step
  kinematic,    ///< follows its keyframes; pushes other bodies as if its mass were infinite
  dynamic,      ///< moved by forces
};

struct BodyDef {
  std::string name;
  Shape shape = Sphere{};
  MotionType motion = MotionType::dynamic;
  Pose pose;                     ///< pose at time 0; a kinematic body with keys has the pose of its keys
  Vec3 velocity = Vec3::Zero();  ///< velocity of the centre of mass [m/s]
  Vec3 angular_velocity = Vec3::Zero();  ///< world axes [rad/s]
  Real density = 1000;                   ///< [kg/m^3], > 0; ignored if mass > 0
  Real mass = 0;                         ///< [kg]; 0: from density and volume
  /// Centre of mass in the body's frame [m]; default: the shape's centre of mass.
  std::optional<Vec3> centre = {};
  /// Inertia about the centre of mass, axes of the body's frame [kg m^2]: symmetric, and each principal
  /// moment at most the sum of the other two. Default: the inertia of the shape about its own centre of mass,
  /// scaled to the mass.
  std::optional<Mat3> inertia = {};
  Real linear_drag = 0;   ///< k_v of F = -k_v (v - wind) [kg/s]
  Real angular_drag = 0;  ///< k_w of tau = -k_w w [kg m^2/s]
  std::string material;   ///< name of the surface for ContactRule; may be empty
  /// Coefficient of restitution in [0, 1]; a pair uses the larger value of its bodies.
  Real restitution = 0.5;
  Real friction = 0.5;        ///< dynamic coefficient of Coulomb friction; a pair uses the geometric mean
  Real static_friction = -1;  ///< static coefficient; negative: the same as `friction`
  /// Dynamic coefficient across friction_axis; negative: the same as along it. In every pair, the friction
  /// across the axis is the friction along it multiplied by the square root of cross_friction / friction.
  /// This also holds if a ContactRule sets the friction. Requires `friction` > 0.
  Real cross_friction = -1;
  /// Friction axis, in the body's frame; zero: isotropic. If both bodies of a pair have a friction axis, the
  /// body that was added first determines the axis.
  Vec3 friction_axis = Vec3::Zero();
  /// Rolling friction [m], >= 0: the greatest torque about a tangent of a contact, divided by the normal
  /// force. It equals the distance between the centre of pressure and the middle of the contact. A pair uses
  /// the larger value.
  Real rolling_friction = 0;
  /// Spinning friction [m], >= 0: the greatest torque about the normal of a contact, divided by the normal
  /// force. For a round contact of radius a it is 3 pi / 16 friction a. A pair uses the larger value.
  Real spinning_friction = 0;
  /// Velocity of the surface relative to the body, for example of a conveyor, in the body's frame [m/s].
  Vec3 surface_velocity = Vec3::Zero();
  bool collides = true;  ///< whether the body collides with bodies and particles
  KeyframeTrack track;   ///< motion of a kinematic body
  /// The body exists from `appear_at` to `remove_at` [s]. It appears at its initial pose and velocity at the
  /// start of the first sub-step at or after appear_at, and is removed at the start of the first sub-step at
  /// or after remove_at. While it does not exist, nothing collides with it, and its springs and joints have
  /// no effect. Its joints are initialized with the poses of the bodies when it appears. Its removal releases
  /// its springs, joints and pins.
  Real appear_at = 0, remove_at = kInfinity;
};

}  // namespace offstage::sim
