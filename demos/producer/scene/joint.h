#pragma once
/// The joints and articulations of a scene; see scene.h. Positions and directions are in the world at time 0.

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "producer/scene/values.h"
#include "sim/articulation/joint.h"

namespace offstage::producer {

/// A target of a motor at a time: degrees or metres, or the same per second.
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
  bool smooth = false;  ///< whether the motion stops at every key
  std::optional<Real> max_effort;
  Real stiffness = 0, damping = 0;
};

/// Free motion of a joint, and its motor.
struct JointBehaviour {
  sim::JointType type = sim::JointType::spherical;
  Vec3 axis = Vec3::UnitZ();
  std::optional<Vec3> second_axis;  ///< default: +X, or `axis` for a gear
  Real ratio = 1;                   ///< ratio of a gear [1], rack [m], screw [m per turn] or pulley [1]
  /// Limits of the displacement of a sliding joint, or of the change of a length [m].
  std::optional<std::array<Real, 2>> limits;
  std::optional<std::array<Real, 2>> length_limits;  ///< least and greatest length of a rope [m]
  std::optional<std::array<Real, 2>> limits_deg;     ///< limits of rotation
  std::optional<Real> swing_deg;
  Real restitution = 0;  ///< coefficient of restitution at the limits
  Real stiffness = 0;    ///< stiffness of a spherical joint [N m/rad]
  Real friction = 0, damping = 0;
  std::optional<JointMotor> motor;
  std::optional<Real> max_force, max_torque;
};

struct Joint {
  Where where;
  std::string name;
  JointBehaviour behaviour;
  std::string a, b;  ///< names of bodies; b is empty for the world
  Vec3 anchor = Vec3::Zero();
  Vec3 anchor_b = Vec3::Zero();  ///< end of a rod or rope, point of a rack
  Vec3 pulley_a = Vec3::Zero(),
       pulley_b = Vec3::Zero();  ///< points of the world over which a pulley's rope runs
  Real appear_at = 0;
  Real remove_at = 1e30;
  bool collide = false;
  bool visible = true;  ///< whether a rod or rope is drawn
  Real radius = 0.01;   ///< radius of the drawn rod or rope [m]
  std::string material;
};

/// Number of straight pieces that a joint is drawn as: a rod, or the three parts of a pulley's rope.
inline int rod_count(const Joint& joint) {
  return joint.behaviour.type == sim::JointType::distance ? 1
         : joint.behaviour.type == sim::JointType::pulley ? 3
                                                          : 0;
}

/// Links between two points: capsules end to end.
struct Chain {
  Where where;
  std::string name;
  Vec3 from = Vec3::Zero(), to = Vec3::UnitX();
  std::vector<Vec3> path;  ///< points of the chain, instead of `from` and `to`
  int links = 10;
  Real sag = 1;  ///< length of the chain as a multiple of the distance
  Real radius = 0.03;
  Real density = 7800;
  std::string material;
  std::string start = "world";  ///< holder of the first link: a body, "world", or nothing
  std::string end;              ///< holder of the last link
  Real swing_deg = 180;
  Real bend_stiffness = 0;  ///< flexural rigidity [N m^2]
  Real friction = 0, damping = 0;
  std::optional<Real> max_force;
};

/// A person of capsules and boxes, standing, arms at the sides.
struct Ragdoll {
  Where where;
  std::string name;
  Vec3 position = Vec3::Zero();  ///< position of the soles
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Real height = 1.75;
  Real density = 1000;
  Real stiffness = 1;                 ///< factor of the joints' dry friction; 1 is a limp adult
  std::string skin, shirt, trousers;  ///< names of materials
  Placement placement;
};

/// A deck of planks, hinged one to the next.
struct Bridge {
  Where where;
  std::string name;
  Vec3 from = Vec3::Zero(), to = Vec3::UnitX();
  int planks = 12;
  Real width = 1, thickness = 0.05;
  Real density = 600;
  std::string material;
  Real sag = 1.02;  ///< length of the deck as a multiple of the distance
  Real damping = 0;
  std::optional<Real> max_force;
};

/// A car on springs: driven by its rear wheels, steered by the front ones. Forwards is +Z, left +X.
struct Vehicle {
  Where where;
  std::string name;
  Vec3 position = Vec3::Zero();  ///< point on the ground at the centre of the wheels
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Real length = 4, width = 1.8, wheel_radius = 0.36;
  Real mass = 1200;
  Real suspension_hz = 1.6;       ///< natural frequency of the suspension
  std::vector<MotorKey> speed;    ///< [m/s]
  std::vector<MotorKey> steer;    ///< steering angle at the centre of the front axle [degrees], left positive
  Real max_torque = 900;          ///< greatest torque of each rear wheel
  std::string paint, trim, tyre;  ///< names of materials
  Placement placement;
};

/// A tower crane with a load on its rope. The jib points along +X.
struct Crane {
  Where where;
  std::string name;
  Vec3 position = Vec3::Zero();  ///< position of the foot of its mast
  Quat orientation = Quat::Identity();
  Real height = 8, reach = 6;
  Real load_mass = 400, load_size = 0.9;
  std::vector<MotorKey> slew;     ///< rotation of the jib [degrees]
  std::vector<MotorKey> trolley;  ///< outward displacement [m]
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
/// The nodes of a model file that have triangles as links, each joined to its parent at the node's origin.
struct ModelTree {
  Where where;
  std::string name;
  std::string file;
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  ModelScale scale;
  Real density = 1000;
  std::string base = "world";  ///< holder of the uppermost nodes: a body, "world", or nothing
  std::string material;        ///< name of the material; empty: the materials of the file
  bool collides = true;
  /// Friction and damping of the joints that are not in `joints`, which are spherical.
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
