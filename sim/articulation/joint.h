#pragma once
/// Joints between two bodies, or a body and the world (physics A1, A6).

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sim/core/handle.h"
#include "sim/core/types.h"
#include "sim/dynamics/interpolation.h"

namespace offstage::sim {

struct BodyTag;
using BodyHandle = Handle<BodyTag>;
struct JointTag {};
using JointHandle = Handle<JointTag>;

enum class JointType : uint8_t {
  spherical,  ///< the anchors stay together
  fixed,      ///< both bodies move as one
  revolute,   ///< turns about the axis
  prismatic,  ///< slides along the axis, without turning
  universal,  ///< turns about the axis, fixed in a, and about the second one, fixed in b
  distance,  ///< the anchors stay as far apart as they are: a massless rod; with limits or a motor its length
             ///< may change: a rope, a winch
};

/// What drives the free coordinate of a joint: the angle of a revolute one [rad], the way of a prismatic one
/// [m], the length of a rod [m]; each 0 as the joint was made.
struct Motor {
  enum class Mode : uint8_t { none, speed, position };
  /// A target at a time; before the first and after the last it stays.
  struct Key {
    Real time = 0;                                          ///< [s]
    Real target = 0;                                        ///< [rad/s] or [m/s], or [rad] or [m]
    Interpolation interpolation = Interpolation::monotone;  ///< to the next key
  };
  Mode mode = Mode::none;
  std::vector<Key> targets = {};  ///< strictly increasing times; none: 0
  bool smooth = false;  ///< stops at every key: between two it changes like a cubic that is at rest at both
  Real max_effort = std::numeric_limits<Real>::infinity();  ///< [N m] or [N]
  /// Of a position: effort = stiffness (target - position) - damping speed. Stiffness 0: it is held, as
  /// firmly as max_effort allows.
  Real stiffness = 0, damping = 0;

  Real target(Real time) const;
};

/// In world coordinates as the bodies stand when the joint is made, which is where its coordinates are 0.
struct JointDef {
  static constexpr Real kFree = std::numeric_limits<Real>::infinity();

  std::string name = {};
  JointType type = JointType::spherical;
  BodyHandle a = {}, b = {};         ///< b may be null: the world
  Vec3 anchor = Vec3::Zero();        ///< where they are joined [m]
  Vec3 anchor_b = Vec3::Zero();      ///< of a rod: its other end, on b [m]
  Vec3 axis = Vec3::UnitZ();         ///< of turning or sliding; of a spherical joint, of its twist
  Vec3 second_axis = Vec3::UnitX();  ///< of a universal joint; not along the axis
  /// Of the free coordinate, in which b is at rest: the angle of a revolute joint, the way of a prismatic
  /// one, what a rod may be longer or shorter (a rope: lower is minus infinity), the twist of a spherical
  /// one, the angle about the axis of a universal one.
  Real lower = -kFree, upper = kFree;
  Real swing =
      kFree;  ///< how far a spherical joint's axis may lean, a universal joint turn about its second [rad]
  Real friction = 0;  ///< dry: greatest torque or force against motion in each free direction [N m] or [N]
  Real damping = 0;   ///< viscous, in each free direction [N m s] or [N s/m]
  Motor motor = {};   ///< of revolute, prismatic and distance joints
  Real max_force = kFree;   ///< breaks beyond [N]
  Real max_torque = kFree;  ///< breaks beyond: what keeps the axes together, limits, motor and friction [N m]
  bool collide = false;     ///< whether the two bodies also collide with each other

  bool has_limits() const { return lower > -kFree || upper < kFree; }
  /// Whether there is a coordinate that limits, motor and friction can act on.
  bool has_free_coordinate() const {
    return type != JointType::fixed &&
           (type != JointType::distance || has_limits() || motor.mode != Motor::Mode::none);
  }
};

/// What can be asked of a joint.
struct JointState {
  Vec3 anchor_a = Vec3::Zero(), anchor_b = Vec3::Zero();  ///< world [m]
  Vec3 axis = Vec3::UnitZ();                              ///< world, with b
  /// On a at its anchor, on average over the last sub-step, impacts included [N], [N m].
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  Real coordinate = 0;  ///< of the free one; 0 for joints that have none
  Real speed = 0;       ///< of the free one
  Real error = 0;       ///< how far the anchors are apart that should not be [m]
  bool broken = false;
};

}  // namespace offstage::sim
