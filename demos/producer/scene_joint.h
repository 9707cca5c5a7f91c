#pragma once
/// The joints and articulations of a scene; see scene.h. Places and directions are those of the world at time 0.

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "producer/scene_values.h"
#include "sim/articulation/joint.h"

namespace offstage::producer {

/// A target of a motor at a time: degrees or metres, or the same per second.
struct MotorKey {
  Real time = 0;
  Real target = 0;
};

struct JointMotor {
  sim::Motor::Mode mode = sim::Motor::Mode::speed;
  Real target = 0;             ///< without keys
  std::vector<MotorKey> keys;  ///< in order of time
  std::optional<Real> max_effort;
  Real stiffness = 0, damping = 0;
};

struct Joint {
  Where where;
  std::string name;
  sim::JointType type = sim::JointType::spherical;
  std::string a, b;  ///< names of bodies; b empty: the world
  Vec3 anchor = Vec3::Zero();
  Vec3 anchor_b = Vec3::Zero();  ///< of a rod
  Vec3 axis = Vec3::UnitZ();
  Vec3 second_axis = Vec3::UnitX();
  std::optional<std::array<Real, 2>> limits;      ///< of sliding and lengths [m]
  std::optional<std::array<Real, 2>> limits_deg;  ///< of turning
  std::optional<Real> swing_deg;
  Real friction = 0, damping = 0;
  std::optional<JointMotor> motor;
  std::optional<Real> max_force, max_torque;
  bool collide = false;
};

/// Links between two points: capsules end to end.
struct Chain {
  Where where;
  std::string name;
  Vec3 from = Vec3::Zero(), to = Vec3::UnitX();
  int links = 10;
  Real sag = 1;  ///< length of the chain over the distance
  Real radius = 0.03;
  Real density = 7800;
  std::string material;
  std::string start = "world";  ///< what holds the first link: a body, "world", or nothing
  std::string end;              ///< likewise the last
  Real swing_deg = 180;
  Real friction = 0, damping = 0;
  std::optional<Real> max_force;
};

/// A person of capsules and boxes, standing, arms at the sides.
struct Ragdoll {
  Where where;
  std::string name;
  Vec3 position = Vec3::Zero();  ///< of the soles
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Real height = 1.75;
  Real density = 1000;
  Real stiffness = 1;            ///< of the joints' dry friction: 1 is a limp grown-up
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
  Real sag = 1.02;  ///< length of the deck over the distance
  Real damping = 0;
  std::optional<Real> max_force;
};

using ArticulationTemplate = std::variant<Chain, Ragdoll, Bridge>;

}  // namespace offstage::producer
