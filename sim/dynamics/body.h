#pragma once
/// A body of the world, as the files that implement it see it.

#include <optional>

#include "sim/collision/collision_shape.h"
#include "sim/collision/contact_frame.h"
#include "sim/collision/distance.h"
#include "sim/collision/pose_path.h"
#include "sim/core/parallel_loop.h"
#include "sim/core/prefetch.h"
#include "sim/dynamics/body_def.h"
#include "sim/dynamics/force_field.h"
#include "sim/dynamics/rigid_body.h"

namespace offstage::sim {

/// Its `solid` points into it and to its mesh, so it stays where it was made.
struct Body {
  // What the contact pairs ask for comes first, so that it lies together.
 private:
  std::optional<CollisionShape> collision_shape_;

 public:
  BodyHandle handle;
  MotionType type = MotionType::dynamic;  // as defined, until it left the world's bounds
  bool asleep = false;
  uint32_t surface = 0;  // number of its material, for rules
  uint32_t island = 0;   // awake: number among the islands of the sub-step; asleep: of the sleeping ones
  uint32_t row = 0;      // among the bodies of its island
  uint32_t rank = 0;     // its place in the order of the world's bodies; see World::Impl::rank_bodies()
  Real extent = 0;       // reach() of the solid; of a plane infinite
  Real impact_speed_bound = 0;  // greatest speed of a body near it that may hit it in the sub-step [m/s]
  Pose pose;                    // now

  // The interval in which it moves at the moment: a whole sub-step, or what an impact has left of it.
  Real from = 0;  // since the sub-step's start [s]
  Pose start_pose;
  Twist start_twist;  // dynamic bodies: of the centre of mass then
  Twist drive;  // kinematic bodies: velocity of the pose's origin and angular velocity, at the interval's end
  Real turning = 0;  // see turning_speed()
  RigidState start;  // dynamic bodies: its state then
  RigidBody rigid;   // dynamic bodies only: now

  Pose before_substep, before_step;
  Aabb swept;             // around its ways in the sub-step, as the broad phase has it
  Real quiet_time = 0;    // for how long it has hardly moved [s]
  bool on_cloth = false;  // touched by cloth in the last sub-step
  Wrench rest_push;       // asleep: what forces that change did to it when it fell asleep, about its centre
  std::vector<SpringHandle> moving_springs;  // asleep: those whose other end can move by itself
  std::optional<Wrench> rest_pins;           // asleep: what cloth on its pins did to it then
  BodyDef def;
  Solid solid;

  /// Asks for the memory of what it is at the interval's start and now.
  void prefetch_interval() const { prefetch(&start_pose, &before_substep); }

  bool is_dynamic() const { return type == MotionType::dynamic; }
  bool is_kinematic() const { return type == MotionType::kinematic; }
  bool is_awake() const { return is_dynamic() && !asleep; }
  /// The speed at which its turning moves its surface in the interval; none of a sphere, which its centre
  /// alone moves [m/s].
  Real turning_speed() const { return is_awake() || is_kinematic() ? turning : 0; }
  bool can_move() const { return is_awake() || (is_kinematic() && def.track.moves()); }
  /// Made when another body first comes near, because a mesh may have to be decomposed for it.
  const CollisionShape& collision_shape();
  /// Pose and velocities of the body's origin at a time not far from now.
  Motion motion(Real now, Real time) const;
  /// An interval begins now.
  void begin_interval(Real time) {
    from = time;
    start = rigid.state();
    start_twist = {rigid.velocity(), rigid.angular_velocity()};
    start_pose = pose;
    set_turning(start_twist.angular_velocity, extent + rigid.centre.norm());
  }
  /// Where the interval brings it to, kinematic.
  void drive_to(const Motion& motion) {
    pose = motion.pose;
    drive = {motion.velocity, motion.angular_velocity};
    set_turning(drive.angular_velocity, extent);
  }
  /// A collision changes the velocities of the centre of mass at the interval's start.
  void set_start_velocity(const Vec3& v, const Vec3& w) {
    start.momentum = rigid.mass * v;
    start.angular_momentum = rigid.spin_momentum(start.orientation, w);
    start_twist = {v, w};
    set_turning(w, extent + rigid.centre.norm());
  }
  /// The body as it was at the interval's start.
  RigidBody at_start() const {
    RigidBody body = rigid;
    body.set_state(start);
    return body;
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
  void set_turning(const Vec3& angular_velocity, Real reach) {
    const bool turns = !std::holds_alternative<Sphere>(def.shape) &&
                       angular_velocity != Vec3::Zero();  // a plane has no reach
    turning = turns ? angular_velocity.norm() * reach : 0;
  }
};

/// Calls work(i) for each body i of many, as for_each_index() does, with the memory of its interval asked for
/// a little before: bodies lie far from each other.
template <class Work>
void for_each_interval(std::span<Body* const> bodies, Work&& work) {
  constexpr std::size_t kAhead = 3;
  for_each_index(bodies.size(), [&](std::size_t i) {
    if (i + kAhead < bodies.size()) bodies[i + kAhead]->prefetch_interval();
    work(i);
  });
}

}  // namespace offstage::sim
