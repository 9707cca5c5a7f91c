#pragma once
/// Joints between two bodies, or between a body and the world (physics A1, A6).

#include <cstdint>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "sim/core/figures.h"
#include "sim/core/handle.h"
#include "sim/core/types.h"
#include "sim/dynamics/interpolation.h"

namespace offstage::sim {

struct BodyTag;
using BodyHandle = Handle<BodyTag>;
struct JointTag {};
using JointHandle = Handle<JointTag>;

enum class JointType : uint8_t {
  spherical,  ///< keeps the anchors together
  fixed,      ///< connects both bodies rigidly
  revolute,   ///< allows rotation about the axis
  prismatic,  ///< allows displacement along the axis, without rotation
  universal,  ///< allows rotation about the axis, fixed in a, and about the second axis, fixed in b
  /// Keeps the distance between the anchors constant, like a massless rod. With limits or a motor the length
  /// may change, like the length of a rope or a winch.
  distance,
  /// Couples the rotation of a about `axis` with the rotation of b about `second_axis`: angle of a + ratio *
  /// angle of b = 0. The axes are fixed in the bodies. Other joints must hold the wheels on a carrier, and
  /// the carrier must not turn.
  gear,
  /// Couples the rotation of a about `axis` with the displacement of b along `second_axis`, a direction of
  /// the world: displacement = ratio * angle, where the ratio is the radius of the pinion [m].
  rack,
  /// Couples rotation of a about the axis with displacement of a along it, relative to b: `ratio` metres per
  /// turn, positive for a right-handed thread.
  screw,
  /// A rope that runs from `anchor` on body a over the fixed points `pulley_a` and `pulley_b` to `anchor_b`
  /// on body b. The length |anchor - pulley_a| + ratio |anchor_b - pulley_b| never exceeds the value that it
  /// has when the joint is created.
  pulley,
};

/// Motor that drives the free coordinate of a joint: the angle of a revolute joint [rad], the displacement of
/// a prismatic joint [m], or the length change of a rod [m]. The coordinate is 0 when the joint is created.
struct Motor {
  enum class Mode : uint8_t { none, speed, position };
  /// Target value at a time. Before the first key and after the last key the target is constant.
  struct Key {
    Real time = 0;    ///< [s]
    Real target = 0;  ///< target speed [rad/s] or [m/s], or target position [rad] or [m]
    Interpolation interpolation = Interpolation::monotone;  ///< interpolation to the next key
  };
  Mode mode = Mode::none;
  std::vector<Key> targets = {};  ///< strictly increasing times; empty: the target is 0
  /// Whether targets are interpolated by a cubic whose rate is zero at every key.
  bool smooth = false;
  /// Greatest torque [N m] or force [N] of the motor, >= 0.
  Real max_effort = std::numeric_limits<Real>::infinity();
  /// For a position target: effort = stiffness (target - position) - damping speed. With stiffness 0 the
  /// target is held rigidly within max_effort.
  Real stiffness = 0, damping = 0;

  Real target(Real time) const;
};

/// Definition of a joint. Points and axes are in world coordinates, for the poses of the bodies when the
/// joint is created. In these poses the joint's coordinates are 0.
struct JointDef {
  static constexpr Real kFree = std::numeric_limits<Real>::infinity();

  std::string name = {};
  JointType type = JointType::spherical;
  BodyHandle a = {}, b = {};     ///< b may be null: the world
  Vec3 anchor = Vec3::Zero();    ///< common point of both bodies [m]
  Vec3 anchor_b = Vec3::Zero();  ///< other end of a rod, on b [m]
  Vec3 axis = Vec3::UnitZ();  ///< axis of rotation or sliding; for a spherical joint, the axis of its twist
  /// Second axis of a universal joint (not parallel to `axis`); axis of the gear wheel b; direction of a
  /// rack.
  Vec3 second_axis = Vec3::UnitX();
  Real ratio = 1;  ///< ratio of a gear [1], rack [m], screw [m per turn] or pulley [1, > 0]; not 0
  Vec3 pulley_a = Vec3::Zero(),
       pulley_b = Vec3::Zero();  ///< points of the world over which the rope runs [m]
  /// Limits of the free coordinate of a relative to b: the angle of a revolute joint, the displacement of a
  /// prismatic joint, the length change of a rod (a rope has lower = minus infinity) or of a pulley's rope,
  /// the twist of a spherical joint, or the angle of a screw or of a universal joint about `axis`. A pulley
  /// without limits has the upper limit 0.
  Real lower = -kFree, upper = kFree;
  Real swing = kFree;  ///< greatest tilt of a spherical joint's axis, or greatest angle of a universal joint
                       ///< about its second axis [rad]
  /// Coefficient of restitution at the limits `lower` and `upper`, in [0, 1], for speeds above kBounceSpeed.
  Real restitution = 0;
  static constexpr Real kBounceSpeed = 0.05;  ///< speeds below this do not rebound at a limit [m/s], [rad/s]
  /// Spherical joints: torque per angle of rotation from the pose at creation, about any axis [N m/rad].
  Real stiffness = 0;
  /// Dry friction: greatest torque or force against motion in each free direction [N m] or [N].
  Real friction = 0;
  Real damping = 0;        ///< viscous damping, in each free direction [N m s] or [N s/m]
  Motor motor = {};        ///< motor of a revolute, prismatic, screw or distance joint
  Real max_force = kFree;  ///< the joint breaks at a larger force [N]
  /// The joint breaks at a larger torque of constraints, limits, motor and friction together [N m].
  Real max_torque = kFree;
  bool collide = false;  ///< whether the two bodies also collide with each other
  /// The joint exists from `appear_at` to `remove_at` [s]. If it appears later than 0, it connects the bodies
  /// in their poses at that time, and its anchors and axes have moved with the bodies.
  Real appear_at = 0, remove_at = kFree;

  /// Returns c + h k: the derivative of the torque k theta + c u of spring and damper by the speed u, for
  /// implicit Euler over an interval of length h [s].
  Real resistance(Real h) const { return damping + h * stiffness; }
  /// Whether a joint of this type only couples motions that other joints allow.
  bool is_coupling() const { return type == JointType::gear || type == JointType::rack; }
  bool has_limits() const { return lower > -kFree || upper < kFree; }
  /// Whether the joint has a coordinate on which limits, motor and friction can act.
  bool has_free_coordinate() const {
    return type != JointType::fixed && !is_coupling() &&
           (type != JointType::distance || has_limits() || motor.mode != Motor::Mode::none);
  }
};

/// Statistics of all joints in a step.
struct JointFigures {
  Real error = 0;         ///< greatest error of a constraint at the end of a motion [m], [rad]
  uint64_t unsolved = 0;  ///< failed factorizations and projections, and motions whose energy was limited

  static constexpr auto figures() {
    using T = JointFigures;
    return std::tuple(Figure("joint_error", &T::error, OverSteps::greatest),
                      Figure("joints_unsolved", &T::unsolved));
  }
  void add(const JointFigures& more) { add_figures(*this, more); }
};

/// State of a joint.
struct JointState {
  Vec3 anchor_a = Vec3::Zero(), anchor_b = Vec3::Zero();  ///< world [m]
  Vec3 axis = Vec3::UnitZ();                              ///< axis of the joint, world; fixed in b
  /// Load on a at its anchor: the mean over the last sub-step, impacts included [N], [N m].
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  Real coordinate = 0;  ///< the free coordinate; 0 for joints without one
  Real speed = 0;       ///< rate of the free coordinate [rad/s] or [m/s]
  Real error = 0;       ///< distance by which the anchors violate the joint [m]
  bool broken = false;
};

}  // namespace offstage::sim
