#pragma once
/// The definition of a body: everything about it that is given before it moves.

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
  static_body,  ///< never moves, costs nothing per step
  kinematic,    ///< follows its keyframes, pushes others with infinite mass
  dynamic,      ///< moved by forces
};

struct BodyDef {
  std::string name;
  Shape shape = Sphere{};
  MotionType motion = MotionType::dynamic;
  Pose pose;                     ///< at time 0; kinematic bodies with keys take the keys' pose instead
  Vec3 velocity = Vec3::Zero();  ///< of the centre of mass [m/s]
  Vec3 angular_velocity = Vec3::Zero();  ///< world axes [rad/s]
  Real density = 1000;                   ///< [kg/m^3], > 0; ignored if mass > 0
  Real mass = 0;                         ///< [kg]; 0: from density and volume
  Real linear_drag = 0;                  ///< k_v of F = -k_v v [kg/s]
  Real angular_drag = 0;                 ///< k_w of tau = -k_w w [kg m^2/s]
  std::string material;                  ///< of the surface: what ContactRule names; may be empty
  Real restitution = 0.5;                ///< of two the larger is used; in [0, 1]
  Real friction = 0.5;                   ///< Coulomb's coefficient of what slides; of two the geometric mean
  Real static_friction = -1;             ///< of what does not; negative: as `friction`
  /// Of sliding across friction_axis; negative: as along it. What it is of `friction`, its square root is in
  /// every pair, whatever a ContactRule says. Not beside a friction of 0.
  Real cross_friction = -1;
  Vec3 friction_axis = Vec3::Zero();  ///< the surface's grain, in the body's frame; zero: none. Of two bodies
                                      ///< with a grain that of the one that was added first counts
  Vec3 surface_velocity =
      Vec3::Zero();      ///< of the surface against the body, as of a conveyor [m/s], its frame
  bool collides = true;  ///< takes part in collisions with bodies and particles
  KeyframeTrack track;   ///< for kinematic bodies
};

}  // namespace offstage::sim
