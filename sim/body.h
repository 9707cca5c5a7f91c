#pragma once
/// A body of the world, as the files that implement it see it.

#include <optional>

#include "sim/collision/collision_shape.h"
#include "sim/collision/distance.h"
#include "sim/collision/pose_path.h"
#include "sim/contact/contact_frame.h"
#include "sim/dynamics/force_field.h"
#include "sim/dynamics/rigid_body.h"
#include "sim/world.h"

namespace offstage::sim {

/// Its `solid` points into it and to its mesh, so it stays where it was made.
struct Body {
  // What the contact pairs ask for comes first, so that it lies together.
  BodyHandle handle;
  MotionType type = MotionType::dynamic;  // as defined, until it left the world's bounds
  bool asleep = false;
  uint32_t surface = 0;  // number of its material, for rules
  uint32_t island = 0;   // awake: number among the islands of the sub-step; asleep: of the sleeping ones
  uint32_t row = 0;      // among the bodies of its island
  Real extent = 0;       // reach() of the solid; of a plane infinite
  Real blow = 0;         // speed of what is near and may strike it in the sub-step [m/s]
  Pose pose;             // now

  // The interval in which it moves at the moment: a whole sub-step, or what an impact has left of it.
  Real from = 0;  // since the sub-step's start [s]
  Pose start_pose;
  Twist start_twist;  // dynamic bodies: of the centre of mass then
  Twist drive;  // kinematic bodies: velocity of the pose's origin and angular velocity, at the interval's end
  RigidBody start;  // dynamic bodies: its state then
  RigidBody rigid;  // dynamic bodies only: now

  Pose before_substep, before_step;
  Aabb swept;             // around its ways in the sub-step, as the broad phase has it
  Real quiet_time = 0;    // for how long it has hardly moved [s]
  bool on_cloth = false;  // touched by cloth in the last sub-step
  Wrench rest_push;       // asleep: what forces that change did to it when it fell asleep, about its centre
  BodyDef def;
  Solid solid;

  bool is_dynamic() const { return type == MotionType::dynamic; }
  bool is_kinematic() const { return type == MotionType::kinematic; }
  bool is_awake() const { return is_dynamic() && !asleep; }
  bool can_move() const { return is_awake() || (is_kinematic() && def.track.moves()); }
  /// Made when another body first comes near, because a mesh may have to be decomposed for it.
  const CollisionShape& collision_shape();
  /// Pose and velocities of the body's origin at a time not far from now.
  Motion motion(Real now, Real time) const;
  /// An interval begins now.
  void begin_interval(Real time) {
    from = time;
    start = rigid;
    start_twist = {rigid.velocity(), rigid.angular_velocity()};
    start_pose = pose;
  }
  /// A collision changes the velocities of the centre of mass at the interval's start.
  void set_start_velocity(const Vec3& v, const Vec3& w) {
    start.set_velocity(v, w);
    start_twist = {v, w};
  }
  /// From the interval's start to now.
  PosePath path() const { return {start_pose, pose}; }
  /// Where it is at a time of a sub-step of length h, not before its interval's start.
  Pose placed_at(Real time, Real h) const {
    if (time <= from || !can_move()) return start_pose;
    return path().at((time - from) / (h - from));
  }
  /// The velocity at the interval's start, of the material point that is at a place of the world.
  Vec3 start_velocity(const Vec3& place) const {
    if (is_awake()) return start_twist.at(place - start.position);
    return is_kinematic() ? drive.at(place - pose.position) : Vec3(Vec3::Zero());
  }

 private:
  std::optional<CollisionShape> collision_shape_;
};

}  // namespace offstage::sim
