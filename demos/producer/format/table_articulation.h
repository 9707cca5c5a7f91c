#pragma once
/// The keys of ready-made articulations: chains, ragdolls, bridges, vehicles, cranes and model files.

#include <array>

#include "producer/format/table_joint.h"
#include "producer/format/table_placement.h"
#include "producer/format/table_shape.h"
#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<Chain> {
  static constexpr const char* kName = "chain";
  static constexpr const char* kHelp =
      "Links in a row from one point to another: bodies NAME/link_0, NAME/link_1 and so on, and joints "
      "NAME/joint_0, NAME/joint_1 and so on.";
  static Fields<Chain> fields() {
    using T = Chain;
    return {
        {"name", &T::name, "unique name; default: articulation_N, where N is the index in the list"},
        {"from", &T::from, "start of the chain, in the world at time 0", "m"},
        {"to", &T::to, "end of the chain, in the world at time 0", "m"},
        {"path", &T::path,
         "instead of `from` and `to`: at least two points in the world; the links lie along the line through "
         "them, in equal steps",
         "m"},
        {"links", &T::links, "number of links", "", between(1, 10000)},
        {"sag", &T::sag,
         "length of the chain, as a multiple of the distance of its ends; must be above 1.0005 if both ends "
         "are held still",
         "", between(1, 3)},
        {"radius", &T::radius, "radius of a link", "m", kPositive},
        {"density", &T::density, "density of a link", "kg/m^3", kPositive},
        {"material", &T::material, "name of a material; empty: grey"},
        {"start", &T::start,
         "name of the body that holds the first link, or `world`; empty: the end is free"},
        {"end", &T::end, "name of the body that holds the last link, or `world`; empty: the end is free"},
        {"swing_deg", &T::swing_deg, "largest angle between neighbouring links", "degrees", between(0, 180)},
        {"bend_stiffness", &T::bend_stiffness,
         "flexural rigidity (Young's modulus times second moment of area) of an elastic rod that is "
         "unstressed as it is laid out; twisting has the same stiffness. A joint between links of the length "
         "l has the stiffness `bend_stiffness` / l per radian, so the rod bends in the same way for any "
         "number of links (at most 32). The bodies that hold the ends of the chain clamp them",
         "N m^2", kNotNegative},
        {"friction", &T::friction, "dry friction of each joint", "N m", kNotNegative},
        {"damping", &T::damping, "viscous damping of each joint", "N m s", kNotNegative},
        {"max_force", &T::max_force, "force above which a joint breaks; default: it never breaks", "N",
         kPositive}};
  }
};
template <>
struct Table<Ragdoll> {
  static constexpr const char* kName = "ragdoll";
  static constexpr const char* kHelp =
      "A standing person who faces +Z and collapses when the film starts: bodies NAME/pelvis, chest, head, "
      "upper_arm_left and so on, with joints that have the limits of human joints.";
  static Fields<Ragdoll> fields() {
    using T = Ragdoll;
    return Fields<T>{
        {"name", &T::name, "unique name; default: articulation_N, where N is the index in the list"},
        {"position", &T::position, "point on the ground between the feet", "m"},
        {"orientation", &T::orientation, "orientation of the figure, about `position`"},
        {"velocity", &T::velocity, "velocity of the figure at time 0", "m/s"},
        {"height", &T::height, "height of the figure", "m", between(0.1, 10)},
        {"density", &T::density, "density of the body parts", "kg/m^3", kPositive},
        {"stiffness", &T::stiffness,
         "factor of the dry friction of the joints: with 0 they rotate freely, with 1 they are as stiff as "
         "in a limp adult",
         "", kNotNegative},
        {"skin", &T::skin, "name of the material of head, hands and feet; empty: grey"},
        {"shirt", &T::shirt, "name of the material of trunk and arms; empty: grey"},
        {"trousers", &T::trousers, "name of the material of pelvis and legs; empty: grey"}}
        .with(&T::placement);
  }
};
template <>
struct Table<Bridge> {
  static constexpr const char* kName = "bridge";
  static constexpr const char* kHelp =
      "Planks hinged to each other between two banks: bodies NAME/plank_0, NAME/plank_1 and so on.";
  static Fields<Bridge> fields() {
    using T = Bridge;
    return {{"name", &T::name, "unique name; default: articulation_N, where N is the index in the list"},
            {"from", &T::from, "start of the bridge, in the world at time 0", "m"},
            {"to", &T::to, "end of the bridge, in the world at time 0", "m"},
            {"planks", &T::planks, "number of planks", "", between(1, 1000)},
            {"width", &T::width, "width of the deck", "m", kPositive},
            {"thickness", &T::thickness, "thickness of a plank", "m", kPositive},
            {"density", &T::density, "density of a plank", "kg/m^3", kPositive},
            {"material", &T::material, "name of a material; empty: grey"},
            {"sag", &T::sag,
             "length of the deck, as a multiple of the distance of the banks; larger: the bridge sags more",
             "", between(1.0005, 2)},
            {"damping", &T::damping, "viscous damping of each hinge", "N m s", kNotNegative},
            {"max_force", &T::max_force, "force above which a hinge breaks; default: it never breaks", "N",
             kPositive}};
  }
};
template <>
struct Table<Vehicle> {
  static constexpr const char* kName = "vehicle";
  static constexpr const char* kHelp =
      "A car with springs, driven by its rear wheels and steered by its front wheels: bodies NAME/chassis, "
      "body, cabin, hub_front_left, knuckle_left, wheel_front_left and so on. It faces +Z.";
  static Fields<Vehicle> fields() {
    using T = Vehicle;
    return Fields<T>{
        {"name", &T::name, "unique name; default: articulation_N, where N is the index in the list"},
        {"position", &T::position, "point on the ground at the centre of the wheels", "m"},
        {"orientation", &T::orientation, "orientation of the car, about `position`"},
        {"velocity", &T::velocity, "velocity of the car at time 0, at which its wheels roll", "m/s"},
        {"length", &T::length, "length of the car's body", "m", kPositive},
        {"width", &T::width, "width over the wheels", "m", kPositive},
        {"wheel_radius", &T::wheel_radius, "radius of each wheel", "m", kPositive},
        {"mass", &T::mass, "mass of the whole car", "kg", kPositive},
        {"suspension_hz", &T::suspension_hz,
         "frequency at which the car oscillates on its springs; larger: stiffer springs", "Hz",
         between(0.2, 10)},
        {"speed", &T::speed,
         "target speed of the rear wheels over time, in m/s; empty: the car rolls freely"},
        {"steer", &T::steer, "angle of the front wheels over time, in degrees, positive to the left"},
        {"max_torque", &T::max_torque, "greatest torque of each rear wheel", "N m", kNotNegative},
        {"paint", &T::paint, "name of the material of the car's body; empty: grey"},
        {"trim", &T::trim, "name of the material of chassis and cabin; empty: grey"},
        {"tyre", &T::tyre, "name of the material of the wheels; empty: grey"}}
        .with(&T::placement);
  }
};
template <>
struct Table<Crane> {
  static constexpr const char* kName = "crane";
  static constexpr const char* kHelp =
      "A tower crane whose jib points along +X, with a load on its rope: bodies NAME/mast, jib, "
      "counterweight, trolley, load, joints NAME/slew, travel, rope.";
  static Fields<Crane> fields() {
    using T = Crane;
    return Fields<T>{
        {"name", &T::name, "unique name; default: articulation_N, where N is the index in the list"},
        {"position", &T::position, "position of the foot of the mast", "m"},
        {"orientation", &T::orientation, "orientation of the crane, about `position`"},
        {"height", &T::height, "height of the mast", "m", kPositive},
        {"reach", &T::reach, "length of the jib", "m", kPositive},
        {"load_mass", &T::load_mass, "mass of the load", "kg", kPositive},
        {"load_size", &T::load_size, "length of an edge of the load, a cube", "m", kPositive},
        {"slew", &T::slew, "rotation of the jib over time, in degrees"},
        {"trolley", &T::trolley,
         "outward displacement of the trolley over time, in metres, from its place at 0.6 of the reach"},
        {"hoist", &T::hoist, "upward displacement of the load over time, in metres"},
        {"frame", &T::frame, "name of the material of mast, jib and trolley; empty: grey"},
        {"load", &T::load, "name of the material of load and counterweight; empty: grey"}}
        .with(&T::placement);
  }
};
template <>
struct Table<NodeJoint> {
  static constexpr const char* kName = "node_joint";
  static constexpr const char* kHelp =
      "The joint between a node of a model and the link above it, at the node's origin.";
  static Fields<NodeJoint> fields() {
    using T = NodeJoint;
    return Fields<T>{
        {"node", &T::node, "name of a node; the joint's axes are in the frame of that node", kRequired}}
        .with(&T::behaviour);
  }
};
template <>
struct Table<ModelTree> {
  static constexpr const char* kName = "model_tree";
  static constexpr const char* kHelp =
      "A model file whose nodes are links: each node with triangles is a body NAME/NODE, and joint NAME/NODE "
      "connects it to the nearest such node above it. `offstage info FILE` lists the nodes.";
  static Fields<ModelTree> fields() {
    using T = ModelTree;
    return Fields<T>{
        {"name", &T::name, "unique name; default: articulation_N, where N is the index in the list"},
        {"file", &T::file, kModelFileHelp, kRequired},
        {"position", &T::position, "position of the model's origin", "m"},
        {"orientation", &T::orientation, "orientation of the model, about `position`"},
        {"velocity", &T::velocity, "velocity of all links at time 0", "m/s"},
        {"scale", &T::scale, kModelScaleHelp, "", kPositive},
        {"density", &T::density, "density of the links", "kg/m^3", kPositive},
        {"base", &T::base,
         "name of the body that holds the uppermost nodes, or `world`; empty: these nodes are free"},
        {"material", &T::material, "name of a material; empty: the materials of the file"},
        {"collides", &T::collides, "whether links collide with all objects that they are not joined to"},
        {"joints", &T::joints,
         "joints with keys of their own, such as a type, a motor or limits; all other joints are spherical"},
        {"friction", &T::friction, "dry friction of the joints that `joints` does not list", "N m",
         kNotNegative},
        {"damping", &T::damping, "viscous damping of the joints that `joints` does not list", "N m s",
         kNotNegative}}
        .with(&T::placement);
  }
};
template <>
struct Tags<ArticulationTemplate> {
  static constexpr const char* kName = "articulation";
  static constexpr const char* kHelp = "Ready-made bodies with their joints.";
  static constexpr std::array kTags = {"chain", "ragdoll", "bridge", "vehicle", "crane", "model"};
  static constexpr bool kRequired = true;
};

}  // namespace offstage::producer
