#include "producer/build/articulation_defs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "producer/build/articulation_builder.h"
#include "producer/build/placement.h"

namespace offstage::producer {
namespace {

constexpr Real kDegree = std::numbers::pi / 180;

void add(Parts parts, Scene& flat) {
  std::move(parts.bodies.begin(), parts.bodies.end(), std::back_inserter(flat.bodies));
  std::move(parts.joints.begin(), parts.joints.end(), std::back_inserter(flat.joints));
}

void scale(Ragdoll& doll, Real factor) {
  doll.height *= factor;
}
void scale(Vehicle& vehicle, Real factor) {
  for (Real* size : {&vehicle.length, &vehicle.width, &vehicle.wheel_radius}) *size *= factor;
  vehicle.mass *= factor * factor * factor;
}
void scale(Crane& crane, Real factor) {
  for (Real* size : {&crane.height, &crane.reach, &crane.load_size}) *size *= factor;
  crane.load_mass *= factor * factor * factor;
}
void scale(ModelTree& tree, Real factor) {
  tree.scale *= factor;
}

template <class Template>
void add_copies(const Template& original, uint64_t seed, Scene& flat, std::vector<Problem>& errors,
                std::vector<Problem>& warnings) {
  if (needs_spacing(original.placement)) {
    Where where = original.where;
    where.path += "/fill";
    errors.push_back({where, "needs a \"spacing\", the distance between neighbouring copies"});
    return;
  }
  if (copy_count(original.placement) > kMaxCopies) {
    errors.push_back({original.where, "asks for more than " + std::to_string(kMaxCopies) +
                                          " copies: the counts of repeat, grid and scatter multiply"});
    return;
  }
  const Copies copies = expand(original.placement, original.position, seed, original.name);
  for (const PlacedCopy& copy : copies.placed) {
    Template moved = original;
    moved.name += copy.suffix;
    moved.position = copy.motion.point_to_world(original.position);
    moved.orientation = copy.motion.orientation * original.orientation;
    if constexpr (requires { moved.velocity; })
      moved.velocity = copy.motion.vector_to_world(original.velocity);
    scale(moved, copy.scale);
    add(build(moved), flat);
  }
  if (copies.left_out == 0) return;
  Where where = original.where;
  where.path += "/scatter";
  warnings.push_back({where, std::to_string(copies.left_out) +
                                 " copies found no free place: reduce min_distance or enlarge size"});
}

const Body* named(const std::vector<Body>& bodies, const std::string& name) {
  const auto it = std::ranges::find(bodies, name, &Body::name);
  return it == bodies.end() ? nullptr : &*it;
}

bool has_copies(const Body* body) {
  return body &&
         (body->placement.fill || body->placement.repeat || body->placement.grid || body->placement.scatter);
}

Vec3 second_axis_of(const JointBehaviour& joint) {
  return joint.second_axis.value_or(joint.type == sim::JointType::gear ? joint.axis : Vec3(Vec3::UnitX()));
}

/// Adds one joint for each copy of the joint's first body.
void add_copies(const Joint& joint, const Scene& scene, Scene& flat) {
  const Body *a = named(scene.bodies, joint.a), *b = named(scene.bodies, joint.b);
  if (!has_copies(a) || copy_count(a->placement) > kMaxCopies) {
    flat.joints.push_back(joint);
    return;
  }
  for (const PlacedCopy& copy : expand(a->placement, a->position, scene.world.seed, a->name).placed) {
    Joint moved = joint;
    moved.name += copy.suffix;
    moved.a += copy.suffix;
    if (has_copies(b)) moved.b += copy.suffix;
    moved.anchor = copy.motion.point_to_world(joint.anchor);
    moved.anchor_b =
        has_copies(b) || joint.b.empty() ? copy.motion.point_to_world(joint.anchor_b) : joint.anchor_b;
    moved.behaviour.axis = copy.motion.vector_to_world(joint.behaviour.axis);
    moved.behaviour.second_axis = copy.motion.vector_to_world(second_axis_of(joint.behaviour));
    moved.pulley_a = copy.motion.point_to_world(joint.pulley_a);
    moved.pulley_b = copy.motion.point_to_world(joint.pulley_b);
    flat.joints.push_back(std::move(moved));
  }
}

sim::Motor motor_def(const JointMotor& motor, Real unit) {
  sim::Motor m{
      .mode = motor.mode, .smooth = motor.smooth, .stiffness = motor.stiffness, .damping = motor.damping};
  if (motor.max_effort) m.max_effort = *motor.max_effort;
  for (const MotorKey& key : motor.keys)
    m.targets.push_back({key.time, unit * key.target, key.interpolation.value_or(motor.interpolation)});
  if (m.targets.empty()) m.targets.push_back({0, unit * motor.target});
  return m;
}

}  // namespace

void expand_joints(const Scene& scene, Scene& flat, std::vector<Problem>& errors,
                   std::vector<Problem>& warnings) {
  flat.joints.clear();
  for (const Joint& joint : scene.joints) add_copies(joint, scene, flat);
  for (const ArticulationTemplate& articulation : scene.articulations)
    std::visit(
        [&](const auto& a) {
          if (a.where.path.empty()) return;  // the articulation has an invalid type and was not read
          if constexpr (requires { a.placement; })
            add_copies(a, scene.world.seed, flat, errors, warnings);
          else
            add(build(a), flat);
        },
        articulation);
}

bool has_rope(sim::JointType type) {
  return type == sim::JointType::distance || type == sim::JointType::pulley;
}

Real rope_length(const Joint& joint) {
  if (joint.behaviour.type == sim::JointType::distance) return (joint.anchor - joint.anchor_b).norm();
  return (joint.anchor - joint.pulley_a).norm() +
         joint.behaviour.ratio * (joint.anchor_b - joint.pulley_b).norm();
}

sim::JointDef joint_def(const Joint& joint) {
  const JointBehaviour& how = joint.behaviour;
  const bool slides = how.type == sim::JointType::prismatic || has_rope(how.type);
  const Real unit = slides ? 1 : kDegree;
  sim::JointDef def{.name = joint.name,
                    .type = how.type,
                    .anchor = joint.anchor,
                    .anchor_b = joint.anchor_b,
                    .axis = how.axis,
                    .second_axis = second_axis_of(how),
                    .ratio = how.ratio,
                    .pulley_a = joint.pulley_a,
                    .pulley_b = joint.pulley_b,
                    .restitution = how.restitution,
                    .stiffness = how.stiffness,
                    .friction = how.friction,
                    .damping = how.damping,
                    .collide = joint.collide,
                    .appear_at = joint.appear_at,
                    .remove_at = joint.remove_at};
  if (const auto& limits = slides ? how.limits : how.limits_deg) {
    def.lower = unit * (*limits)[0];
    def.upper = unit * (*limits)[1];
  }
  if (how.length_limits && has_rope(how.type)) {
    const Real length = rope_length(joint);
    def.lower = std::min(0.0, (*how.length_limits)[0] - length);
    def.upper = std::max(0.0, (*how.length_limits)[1] - length);
  }
  if (how.swing_deg) def.swing = kDegree * *how.swing_deg;
  if (how.motor) def.motor = motor_def(*how.motor, unit);
  if (how.max_force) def.max_force = *how.max_force;
  if (how.max_torque) def.max_torque = *how.max_torque;
  return def;
}

}  // namespace offstage::producer
