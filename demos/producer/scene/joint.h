#pragma once
/// The joints and articulations of a scene; see scene.h. Positions and directions are given in the world
/// frame for the bodies' poses at time 0.

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "producer/scene/values.h"
#include "sim/articulation/joint.h"

namespace offstage::producer {

/// Target of a motor at one time: a position [degrees or m] or a speed [degrees/s or m/s].
struct MotorKey {
  Real time = 0;
  Real target = 0;
  /// Interpolation to the next key; default: the interpolation of the motor.
  std::optional<sim::Interpolation> interpolation;
};

struct JointMotor {
  sim::Motor::Mode mode = sim::Motor::Mode::speed;
  Real target = 0;             ///< target, if there are no keys
  std::vector<MotorKey> keys;  ///< targets in order of time
  sim::Interpolation interpolation = sim::Interpolation::monotone;
  bool smooth = false;  ///< whether the motor stops at every key
  std::optional<Real> max_effort;
  Real stiffness = 0, damping = 0;
};

/// The motion that a joint allows, with its limits, resistance and motor.
struct JointBehaviour {
  sim::JointType type = sim::JointType::spherical;
  Vec3 axis = Vec3::UnitZ();
  std::optional<Vec3> second_axis;  ///< direction of the second axis; default: +X, or `axis` for a gear
  Real ratio = 1;                   ///< gear [1], rack [m], screw [m per turn] or pulley [1]
  /// Limits of the displacement of a sliding joint, or of the change of a length [m].
  std::optional<std::array<Real, 2>> limits;
  std::optional<std::array<Real, 2>> length_limits;  ///< least and greatest length of a rope [m]
  std::optional<std::array<Real, 2>> limits_deg;     ///< limits of rotation [degrees]
  std::optional<Real> swing_deg;  ///< greatest swing of a spherical or universal joint [degrees]
  Real restitution = 0;           ///< coefficient of restitution at the limits
  Real stiffness = 0;             ///< stiffness of a spherical joint [N m/rad]
  Real friction = 0, damping = 0;
  std::optional<JointMotor> motor;
  std::optional<Real> max_force, max_torque;
};

struct Joint {
  Where where;
  std::string name;
  JointBehaviour behaviour;
  std::string a, b;  ///< names of the joined bodies; an empty `b` is the world
  Vec3 anchor = Vec3::Zero();
  Vec3 anchor_b = Vec3::Zero();  ///< other end of a rod or rope, on `b`; or a point of the rack
  Vec3 pulley_a = Vec3::Zero(),
       pulley_b = Vec3::Zero();  ///< fixed points over which the rope of a pulley runs
  Real appear_at = 0;
  Real remove_at = 1e30;
  bool collide = false;  ///< whether the joined bodies also collide with each other
  bool visible = true;   ///< whether a rod or rope is drawn
  Real radius = 0.01;    ///< radius of the drawn rod or rope [m]
  std::string material;
};

/// Returns the number of cylinders that are drawn for a joint: 1 for a distance joint, 3 for a pulley, 0 for
/// other joints.
inline int rod_count(const Joint& joint) {
  return joint.behaviour.type == sim::JointType::distance ? 1
         : joint.behaviour.type == sim::JointType::pulley ? 3
                                                          : 0;
}

/// A chain between two points. Its links are capsules, joined end to end.
struct Chain {
  Where where;
  std::string name;
  Vec3 from = Vec3::Zero(), to = Vec3::UnitX();
  std::vector<Vec3> path;  ///< points of the chain, instead of `from` and `to`
  int links = 10;
  Real sag = 1;  ///< length of the chain divided by the distance between its ends
  Real radius = 0.03;
  Real density = 7800;
  std::string material;
  std::string start = "world";  ///< body that holds the first link, or "world"; empty: it is free
  std::string end;              ///< body that holds the last link, or "world"; empty: it is free
  Real swing_deg = 180;
  Real bend_stiffness = 0;  ///< flexural rigidity [N m^2]
  Real friction = 0, damping = 0;
  std::optional<Real> max_force;
};

/// A human figure of capsules and boxes. At time 0 it stands with its arms at its sides.
struct Ragdoll {
  Where where;
  std::string name;
  Vec3 position = Vec3::Zero();  ///< position of the ground between the feet
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Real height = 1.75;
  Real density = 1000;
  Real stiffness = 1;                 ///< factor of the joints' dry friction; 1: a relaxed adult
  std::string skin, shirt, trousers;  ///< names of materials
  Placement placement;
};

/// A hanging bridge: a deck of planks, each hinged to the next one.
struct Bridge {
  Where where;
  std::string name;
  Vec3 from = Vec3::Zero(), to = Vec3::UnitX();
  int planks = 12;
  Real width = 1, thickness = 0.05;
  Real density = 600;
  std::string material;
  Real sag = 1.02;  ///< length of the deck divided by the distance between its ends
  Real damping = 0;
  std::optional<Real> max_force;
};

/// A car with spring suspension, rear-wheel drive and front-wheel steering. Its forward direction is +Z, its
/// left is +X.
struct Vehicle {
  Where where;
  std::string name;
  Vec3 position = Vec3::Zero();  ///< point on the ground at the centre of the wheels
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Real length = 4, width = 1.8, wheel_radius = 0.36;
  Real mass = 1200;
  Real suspension_hz = 1.6;     ///< natural frequency of the suspension [Hz]
  std::vector<MotorKey> speed;  ///< speed of the car [m/s]
  std::vector<MotorKey> steer;  ///< steering angle at the centre of the front axle [degrees]; positive: left
  Real max_torque = 900;        ///< greatest torque at each rear wheel [N m]
  std::string paint, trim, tyre;  ///< names of materials
  Placement placement;
};

/// A tower crane with a load on its rope. The jib points along +X.
struct Crane {
  Where where;
  std::string name;
  Vec3 position = Vec3::Zero();  ///< position of the foot of the mast
  Quat orientation = Quat::Identity();
  Real height = 8, reach = 6;
  Real load_mass = 400, load_size = 0.9;
  std::vector<MotorKey> slew;     ///< rotation of the jib [degrees]
  std::vector<MotorKey> trolley;  ///< outward displacement of the trolley [m]
  std::vector<MotorKey> hoist;    ///< upward displacement of the load [m]
  std::string frame, load;        ///< names of materials
  Placement placement;
};

/// The joint between a node of a model and its parent.
struct NodeJoint {
  Where where;
  std::string node;
  JointBehaviour behaviour;  ///< axes are in the node's frame
};
/// An articulation that is read from a model file. Each node that has triangles becomes a link. A joint at
/// the node's origin connects the link to the link of its parent.
struct ModelTree {
  Where where;
  std::string name;
  std::string file;
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  ModelScale scale;
  Real density = 1000;
  std::string base = "world";  ///< body that holds the root nodes, or "world"; empty: they are free
  std::string material;        ///< name of the material; empty: the materials of the file
  bool collides = true;
  /// Friction and damping of the joints that `joints` does not list. These joints are spherical.
  Real friction = 0, damping = 0;
  std::vector<NodeJoint> joints;
  Placement placement;

  /// A node as read from the file; see render::Model::Node.
  struct Link {
    std::string name;
    int parent;
    sim::Pose pose;
  };
  std::vector<Link> links;  ///< nodes of the file; empty if the file could not be read
};

using ArticulationTemplate = std::variant<Chain, Ragdoll, Bridge, Vehicle, Crane, ModelTree>;

}  // namespace offstage::producer
