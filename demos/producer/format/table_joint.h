#pragma once
/// The keys of joints and of ready-made articulations.

#include <array>

#include "producer/format/table_world.h"

namespace offstage::producer {

template <>
struct Names<sim::JointType> {
  static constexpr std::array kNames = {"spherical", "fixed",     "revolute",
                                        "prismatic", "universal", "distance"};
};
template <>
struct Names<sim::Motor::Mode> {
  static constexpr std::array kNames = {"none", "speed", "position"};
};

template <>
struct Table<MotorKey> {
  static constexpr const char* kName = "motor_key";
  static constexpr const char* kHelp = "A target at a time.";
  static Fields<MotorKey> fields() {
    return {{"time", &MotorKey::time, "when; times must increase", "s"},
            {"target", &MotorKey::target, "as that of the motor"},
            {"interpolation", &MotorKey::interpolation, "from this key to the next; left out: the motor's"}};
  }
};
template <>
struct Table<JointMotor> {
  static constexpr const char* kName = "motor";
  static constexpr const char* kHelp = "What drives a revolute, prismatic or distance joint.";
  static Fields<JointMotor> fields() {
    using T = JointMotor;
    return {
        {"mode", &T::mode, "what it works towards: a speed, or a position counted from that at time 0"},
        {"target", &T::target, "degrees or metres, or these per second; `keys` come before it"},
        {"keys", &T::keys, "targets over time"},
        {"interpolation", &T::interpolation, kInterpolationHelp},
        {"smooth", &T::smooth, "whether a `monotone` curve stands still at every key"},
        {"max_effort", &T::max_effort, "greatest torque or force; left out: whatever it takes", "N m or N",
         kNotNegative},
        {"stiffness", &T::stiffness, "of a position, per radian or metre; 0: firm", "N m or N/m",
         kNotNegative},
        {"damping", &T::damping, "of a position with stiffness, per speed", "N m s or N s/m", kNotNegative}};
  }
};

template <>
struct Table<JointBehaviour> {
  static Fields<JointBehaviour> fields() {
    using T = JointBehaviour;
    return {
        {"type", &T::type,
         "what stays free: all turning; nothing; turning about the axis; sliding along it; turning about two "
         "axes; "
         "all but the distance of the anchors: a rod, or with limits or a motor a rope or a winch"},
        {"axis", &T::axis, "of turning or sliding; of a spherical joint, of its twist", "", kDirection},
        {"second_axis", &T::second_axis, "of a universal joint", "", kDirection},
        {"limits", &T::limits,
         "least and greatest way of a prismatic joint, or change of the distance: a rope has [-its length, "
         "0]",
         "m"},
        {"limits_deg", &T::limits_deg, "least and greatest angle; of a spherical joint, of its twist",
         "degrees"},
        {"swing_deg", &T::swing_deg,
         "how far a spherical joint's axis may lean, or a universal one turn about its second", "degrees",
         between(0, 180)},
        {"friction", &T::friction, "dry: greatest torque or force against motion", "N m or N", kNotNegative},
        {"damping", &T::damping, "viscous: torque or force per speed", "N m s or N s/m", kNotNegative},
        {"motor", &T::motor, "what drives it"},
        {"max_force", &T::max_force, "beyond which it breaks; left out: never", "N", kPositive},
        {"max_torque", &T::max_torque, "beyond which it breaks; left out: never", "N m", kPositive},
    };
  }
};
template <>
struct Table<Joint> {
  static constexpr const char* kName = "joint";
  static constexpr const char* kHelp =
      "Holds two bodies together, or one and the world, as they stand at time 0. Where bodies have copies, "
      "each "
      "copy of `a` is joined to the copy of `b` with the same number, or to the one `b` if that has none.";
  static Fields<Joint> fields() {
    using T = Joint;
    return Fields<T>{{"name", &T::name, "unique; empty: joint_ and its index"},
                     {"a", &T::a, "name of a body", kRequired},
                     {"b", &T::b, "name of a body; empty: the world"},
                     {"anchor", &T::anchor, "where they are joined", "m"},
                     {"anchor_b", &T::anchor_b, "the other end of a distance joint, on b", "m"}}
        .with(&T::behaviour)
        .then({{"collide", &T::collide, "whether the two bodies also collide with each other"},
               {"visible", &T::visible, "whether a distance joint is drawn, as a straight rod"},
               {"radius", &T::radius, "of that rod", "m", kPositive},
               {"material", &T::material, "of that rod: name of a material; empty: grey"}});
  }
};

template <>
struct Table<Chain> {
  static constexpr const char* kName = "chain";
  static constexpr const char* kHelp =
      "Links end to end from one point to another: bodies NAME/link_0 and on, joints NAME/joint_0 and on.";
  static Fields<Chain> fields() {
    using T = Chain;
    return {
        {"name", &T::name, "unique; empty: articulation_ and its index"},
        {"from", &T::from, "where it begins", "m"},
        {"to", &T::to, "where it ends", "m"},
        {"links", &T::links, "how many", "", between(1, 10000)},
        {"sag", &T::sag, "length of the chain over the distance; over 1.0005 if both ends are held still", "",
         between(1, 3)},
        {"radius", &T::radius, "of a link", "m", kPositive},
        {"density", &T::density, "of a link", "kg/m^3", kPositive},
        {"material", &T::material, "name of a material; empty: grey"},
        {"start", &T::start, "what holds the first link: name of a body, `world`, or empty: nothing"},
        {"end", &T::end, "the same of the last"},
        {"swing_deg", &T::swing_deg, "how far a link may lean against the next", "degrees", between(0, 180)},
        {"friction", &T::friction, "dry, of each joint", "N m", kNotNegative},
        {"damping", &T::damping, "viscous, of each joint", "N m s", kNotNegative},
        {"max_force", &T::max_force, "beyond which a joint breaks; left out: never", "N", kPositive}};
  }
};
template <>
struct Table<Ragdoll> {
  static constexpr const char* kName = "ragdoll";
  static constexpr const char* kHelp =
      "A person who stands, looking along +Z, and lets go: bodies NAME/pelvis, chest, head, upper_arm_left "
      "and so "
      "on, with joints that bend as people do.";
  static Fields<Ragdoll> fields() {
    using T = Ragdoll;
    return Fields<T>{
        {"name", &T::name, "unique; empty: articulation_ and its index"},
        {"position", &T::position, "between the soles", "m"},
        {"orientation", &T::orientation, "of the whole figure about that place"},
        {"velocity", &T::velocity, "of all of it at time 0", "m/s"},
        {"height", &T::height, "of the figure", "m", between(0.1, 10)},
        {"density", &T::density, "of its parts", "kg/m^3", kPositive},
        {"stiffness", &T::stiffness, "of its joints: 0 turns freely, 1 is limp", "", kNotNegative},
        {"skin", &T::skin, "name of a material: head, hands and feet; empty: grey"},
        {"shirt", &T::shirt, "the same: trunk and arms"},
        {"trousers", &T::trousers, "the same: pelvis and legs"}}
        .with(&T::placement);
  }
};
template <>
struct Table<Bridge> {
  static constexpr const char* kName = "bridge";
  static constexpr const char* kHelp =
      "Planks hinged one to the next between two banks: bodies NAME/plank_0 and on.";
  static Fields<Bridge> fields() {
    using T = Bridge;
    return {{"name", &T::name, "unique; empty: articulation_ and its index"},
            {"from", &T::from, "where it begins", "m"},
            {"to", &T::to, "where it ends", "m"},
            {"planks", &T::planks, "how many", "", between(1, 1000)},
            {"width", &T::width, "of the deck", "m", kPositive},
            {"thickness", &T::thickness, "of a plank", "m", kPositive},
            {"density", &T::density, "of a plank", "kg/m^3", kPositive},
            {"material", &T::material, "name of a material; empty: grey"},
            {"sag", &T::sag, "length of the deck over the distance of the banks", "", between(1.0005, 2)},
            {"damping", &T::damping, "viscous, of each hinge", "N m s", kNotNegative},
            {"max_force", &T::max_force, "beyond which a hinge breaks; left out: never", "N", kPositive}};
  }
};
template <>
struct Table<Vehicle> {
  static constexpr const char* kName = "vehicle";
  static constexpr const char* kHelp =
      "A car on springs, its rear wheels driven, its front wheels steered: bodies NAME/chassis, body, cabin, "
      "hub_front_left, knuckle_left, wheel_front_left and so on. It looks along +Z.";
  static Fields<Vehicle> fields() {
    using T = Vehicle;
    return Fields<T>{
        {"name", &T::name, "unique; empty: articulation_ and its index"},
        {"position", &T::position, "on the ground in the middle of its wheels", "m"},
        {"orientation", &T::orientation, "of all of it about that place"},
        {"velocity", &T::velocity, "of all of it at time 0", "m/s"},
        {"length", &T::length, "of its body", "m", kPositive},
        {"width", &T::width, "over its wheels", "m", kPositive},
        {"wheel_radius", &T::wheel_radius, "of each wheel", "m", kPositive},
        {"mass", &T::mass, "of all of it", "kg", kPositive},
        {"suspension_hz", &T::suspension_hz, "how often it bounces on its springs", "Hz", between(0.2, 10)},
        {"speed", &T::speed, "what its rear wheels work towards over time, in m/s; none: it rolls"},
        {"steer", &T::steer, "how its front wheels stand over time, in degrees, to the left positive"},
        {"max_torque", &T::max_torque, "of each rear wheel", "N m", kNotNegative},
        {"paint", &T::paint, "name of a material: body; empty: grey"},
        {"trim", &T::trim, "the same: chassis and cabin"},
        {"tyre", &T::tyre, "the same: wheels"}}
        .with(&T::placement);
  }
};
template <>
struct Table<Crane> {
  static constexpr const char* kName = "crane";
  static constexpr const char* kHelp =
      "A tower crane whose jib points along +X, with a load on its rope: bodies NAME/mast, jib, "
      "counterweight, "
      "trolley, load, joints NAME/slew, way, rope.";
  static Fields<Crane> fields() {
    using T = Crane;
    return Fields<T>{{"name", &T::name, "unique; empty: articulation_ and its index"},
                     {"position", &T::position, "the foot of its mast", "m"},
                     {"orientation", &T::orientation, "of all of it about that place"},
                     {"height", &T::height, "of the mast", "m", kPositive},
                     {"reach", &T::reach, "of the jib", "m", kPositive},
                     {"load_mass", &T::load_mass, "of the load", "kg", kPositive},
                     {"load_size", &T::load_size, "side of the load, a cube", "m", kPositive},
                     {"slew", &T::slew, "how the jib turns over time, in degrees"},
                     {"trolley", &T::trolley,
                      "how far the trolley goes outwards over time, in metres, from 0.6 of the reach"},
                     {"hoist", &T::hoist, "how far the load is lifted over time, in metres"},
                     {"frame", &T::frame, "name of a material: mast, jib and trolley; empty: grey"},
                     {"load", &T::load, "the same: load and counterweight"}}
        .with(&T::placement);
  }
};
template <>
struct Table<NodeJoint> {
  static constexpr const char* kName = "node_joint";
  static constexpr const char* kHelp =
      "The joint between a node of a model and the one above it, at its origin.";
  static Fields<NodeJoint> fields() {
    using T = NodeJoint;
    return Fields<T>{{"node", &T::node, "name of a node; axes are those of that node", kRequired}}.with(
        &T::behaviour);
  }
};
template <>
struct Table<ModelTree> {
  static constexpr const char* kName = "model_tree";
  static constexpr const char* kHelp =
      "A model file whose nodes are links: each that has triangles is a body NAME/NODE, joined to the "
      "nearest such "
      "node above it, joint NAME/NODE. `offstage info FILE` lists the nodes.";
  static Fields<ModelTree> fields() {
    using T = ModelTree;
    return Fields<T>{
        {"name", &T::name, "unique; empty: articulation_ and its index"},
        {"file", &T::file, "model file", kRequired},
        {"position", &T::position, "of the model's origin", "m"},
        {"orientation", &T::orientation, "of the whole model about that place"},
        {"velocity", &T::velocity, "of all of it at time 0", "m/s"},
        {"scale", &T::scale, "factor of its size", "", kPositive},
        {"density", &T::density, "of its links", "kg/m^3", kPositive},
        {"base", &T::base, "what holds the uppermost nodes: name of a body, `world`, or empty: nothing"},
        {"material", &T::material, "name of a material; empty: those of the file"},
        {"collides", &T::collides, "whether links collide with what they are not joined to"},
        {"joints", &T::joints, "those that are not spherical, or are driven or limited"},
        {"friction", &T::friction, "dry, of the other joints", "N m", kNotNegative},
        {"damping", &T::damping, "viscous, of the other joints", "N m s", kNotNegative}}
        .with(&T::placement);
  }
};
template <>
struct Tags<ArticulationTemplate> {
  static constexpr const char* kName = "articulation";
  static constexpr const char* kHelp = "Bodies and joints ready made.";
  static constexpr std::array kTags = {"chain", "ragdoll", "bridge", "vehicle", "crane", "model"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
