#pragma once
/// The keys of joints and of their motors.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Names<sim::JointType> {
  static constexpr std::array kNames = {"spherical", "fixed", "revolute", "prismatic", "universal",
                                        "distance",  "gear",  "rack",     "screw",     "pulley"};
};
template <>
struct Names<sim::Motor::Mode> {
  static constexpr std::array kNames = {"none", "speed", "position"};
};

template <>
struct Table<MotorKey> {
  static constexpr const char* kName = "motor_key";
  static constexpr const char* kHelp = "A motor's target at a time.";
  static Fields<MotorKey> fields() {
    return {{"time", &MotorKey::time, "time of the key; times must increase", "s"},
            {"target", &MotorKey::target,
             "target position or speed of the motor at this time, in the unit of `target` of the motor"},
            {"interpolation", &MotorKey::interpolation,
             "interpolation from this key to the next; default: the interpolation of the motor"}};
  }
};
template <>
struct Table<JointMotor> {
  static constexpr const char* kName = "motor";
  static constexpr const char* kHelp = "Motor of a revolute, prismatic, screw or distance joint.";
  static Fields<JointMotor> fields() {
    using T = JointMotor;
    return {
        {"mode", &T::mode,
         "quantity that the motor controls: a speed, or a position relative to the position at time 0"},
        {"target", &T::target,
         "constant target: a position in degrees or metres, or a speed in degrees per second or metres per "
         "second; not with `keys`"},
        {"keys", &T::keys, "targets over time, instead of `target`"},
        {"interpolation", &T::interpolation, kInterpolationHelp},
        {"smooth", &T::smooth,
         "whether a `monotone` curve through the keys has zero slope at every key, so that a position motor "
         "stops there"},
        {"max_effort", &T::max_effort, "greatest torque or force of the motor; default: unlimited",
         "N m or N", kNotNegative},
        {"stiffness", &T::stiffness,
         "torque or force of the motor per radian or metre from the target position; 0: the position is "
         "controlled rigidly. "
         "Oscillations with fewer than six times `world.step` per period are damped",
         "N m or N/m", kNotNegative},
        {"damping", &T::damping, "torque or force per speed that damps position control; needs a `stiffness`",
         "N m s or N s/m", kNotNegative}};
  }
};

template <>
struct Table<JointBehaviour> {
  static Fields<JointBehaviour> fields() {
    using T = JointBehaviour;
    return {
        {"type", &T::type,
         "degrees of freedom: `spherical` rotates freely; `fixed` has none; `revolute` rotates about the "
         "axis; `prismatic` slides along the axis; `universal` rotates about two axes; `distance` keeps the "
         "distance of the anchors, as a rod does, or with limits or a motor as a rope or a winch; `gear` "
         "couples the rotation of `a` about `axis` to the rotation of `b` about `second_axis`: angle of a + "
         "`ratio` * angle of b = 0; `rack` couples the rotation of `a` about `axis` to the displacement of "
         "`b` along `second_axis`: displacement = `ratio` * angle; `screw` rotates about the axis and moves "
         "`ratio` metres along it per turn; `pulley` is a rope from `anchor` over `pulley_a` and `pulley_b` "
         "to `anchor_b`. Gears and racks only couple motions: their bodies need other joints, which hold "
         "them on a carrier that does not turn"},
        {"axis", &T::axis,
         "axis of rotation or sliding; for a spherical joint, axis of the twist. It is a direction in the "
         "world at time 0 or, for a joint of a model, in the frame of `node`",
         "", kDirection},
        {"second_axis", &T::second_axis,
         "second axis of a universal joint, axis of `b` of a gear, or direction of a rack, in the same frame "
         "as `axis`; default: +X, or `axis` for a gear",
         "", kDirection},
        {"ratio", &T::ratio,
         "gear: teeth of `b` / teeth of `a`, negative for an internal gear or a belt; rack: radius of the "
         "pinion in m, negative for the other direction; screw: lead in m per turn, positive for a "
         "right-handed thread; pulley: number of strands at `b`. Not 0"},
        {"limits", &T::limits,
         "least and greatest displacement of a prismatic joint, or change of the distance of a distance "
         "joint: a rope has [-its length, 0]",
         "m"},
        {"length_limits", &T::length_limits,
         "instead of `limits`: least and greatest length of the rope of a distance joint or a pulley. The "
         "length of a pulley's rope is the distance from `anchor` to `pulley_a` plus `ratio` times the "
         "distance from `anchor_b` to `pulley_b`. Without limits, the rope of a pulley cannot get longer "
         "than at the start",
         "m", kNotNegative},
        {"limits_deg", &T::limits_deg,
         "least and greatest angle of rotation about `axis`; 0 is the angle at time 0. For a spherical joint "
         "these are limits of the twist",
         "degrees"},
        {"swing_deg", &T::swing_deg,
         "spherical joint: largest angle between the axes of the two bodies; universal joint: largest angle "
         "of rotation about the second axis",
         "degrees", between(0, 180)},
        {"restitution", &T::restitution,
         "coefficient of restitution at `limits`, `length_limits`, `limits_deg` and `swing_deg`, for speeds "
         "above 0.05 m/s or rad/s",
         "", kFraction},
        {"stiffness", &T::stiffness,
         "spherical joint: torque per angle of rotation from the pose of time 0, about any axis; for the "
         "other types use a motor with a stiffness",
         "N m/rad", kNotNegative},
        {"friction", &T::friction, "dry friction of the joint: greatest torque or force against its motion",
         "N m or N", kNotNegative},
        {"damping", &T::damping, "viscous damping of the joint: torque or force per speed", "N m s or N s/m",
         kNotNegative},
        {"motor", &T::motor, "motor that drives the joint"},
        {"max_force", &T::max_force, "force above which the joint breaks; default: it never breaks", "N",
         kPositive},
        {"max_torque", &T::max_torque, "torque above which the joint breaks; default: it never breaks", "N m",
         kPositive},
    };
  }
};
template <>
struct Table<Joint> {
  static constexpr const char* kName = "joint";
  static constexpr const char* kHelp =
      "Connects two bodies, or a body and the world, in their poses at time 0. If `a` has copies, each copy "
      "is joined to the copy of `b` with the same number, or to `b` itself if `b` has no copies.";
  static Fields<Joint> fields() {
    using T = Joint;
    return Fields<T>{
        {"name", &T::name, "unique name; default: joint_N, where N is the index in the list"},
        {"a", &T::a, "name of a body", kRequired},
        {"b", &T::b, "name of a body; empty: the world"},
        {"anchor", &T::anchor, "point at which the bodies are joined, in the world at time 0", "m"},
        {"anchor_b", &T::anchor_b,
         "distance joint or pulley: point of `b` at which the rod or the rope ends, in the world at time 0; "
         "rack: a point of `b`",
         "m"},
        {"pulley_a", &T::pulley_a, "for a pulley: fixed point in the world over which the rope from `a` runs",
         "m"},
        {"pulley_b", &T::pulley_b, "for a pulley: fixed point in the world over which the rope from `b` runs",
         "m"}}
        .with(&T::behaviour)
        .then({{"collide", &T::collide, "whether the two bodies also collide with each other"},
               {"appear_at", &T::appear_at,
                "time at which the joint starts to act. It joins the bodies in their poses at that time; "
                "until then its anchors and axes move with the bodies",
                "s", kNotNegative},
               {"remove_at", &T::remove_at,
                "time at which the joint is removed; must be later than `appear_at`", "s", kPositive},
               {"visible", &T::visible, "whether a distance joint is drawn as a straight rod"},
               {"radius", &T::radius, "radius of the drawn rod", "m", kPositive},
               {"material", &T::material, "name of the rod's material; empty: grey"}});
  }
};

}  // namespace offstage::producer
