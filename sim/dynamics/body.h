#pragma once
/// A body of the world: its constant model, its state, and its data for the current sub-step.

#include <array>
#include <optional>
#include <vector>

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

/// contact_motion() predicts the contacts of a body only if it turns by less than this angle in a sub-step
/// [rad].
inline constexpr Real kMostPredictedTurn = 1;

/// The definition of a body, which is constant from World::add_body() on. `solid` has pointers into the body
/// and to its mesh, so a body is never moved or copied. The members that contact pairs read are the last
/// ones, next to the state in memory.
struct BodyModel {
  BodyDef def;
  Solid solid;

  /// Shape for collision detection. It is created at the first call, which may have to decompose a mesh.
  const CollisionShape& collision_shape();
  /// Shape that consists of the triangles of the mesh, for impacts between two meshes. It is created at the
  /// first call.
  const CollisionShape& triangle_shape();

 private:
  std::optional<CollisionShape> collision_shape_, triangle_shape_;

 public:
  BodyHandle handle;
  TreeChoice tree = {};  // tree of its collision shapes
  uint32_t surface = 0;  // number of its material, for contact rules
  Real extent = 0;       // reach() of the solid; infinite for a plane
};

/// Data that decides when a body falls asleep and wakes.
struct SleepMemory {
  Real quiet_time = 0;  // how long the body has been almost at rest [s]
  // While it is asleep:
  Wrench push;                 // wrench of the variable forces when it fell asleep, about its centre of mass
  std::optional<Wrench> pins;  // wrench of pinned cloth when it fell asleep
  std::vector<SpringHandle> moving_springs;  // springs whose other end can move independently
};

/// The acceleration of a body by contacts. Springs and drag depend on the motion of the body. The free motion
/// contains this acceleration, so that they act along a path close to the true one, and takes it back at its
/// end (physics R7).
class HeldMotion {
 public:
  /// Begins a sub-step of a body. Its acceleration is extrapolated from the last ones, if the sub-steps
  /// resolve their course: an impact does not repeat.
  void begin_substep(const RigidBody& body);
  /// Stores the acceleration in the current sub-step [m/s^2], [rad/s^2].
  void set(const Twist& acceleration) { last_[0] = acceleration; }
  /// Adds the expected acceleration to the forces on the body.
  void add_to(RigidBody& body);
  /// Takes the acceleration back after a motion of this duration [s]: velocity, position, and the force.
  void take_back(RigidBody& body, Real duration);

 private:
  std::array<Twist, 3> last_;  // accelerations in the current sub-step and the two before
  Twist expected_;
  Wrench added_;
};

struct Body : BodyModel {
  // State. The members that contact pairs read come first, close together in memory.
  MotionType type =
      MotionType::dynamic;  // as defined; static while absent and after it left the world's bounds
  bool asleep = false;
  bool was_present = true;  // whether it has appeared
  bool absent = false;      // it has not appeared yet, or was removed; then `type` is static
  Pose pose;                // at the current time

  // Its place in the lists of the current sub-step.
  uint32_t island = 0;          // awake: number of its island; asleep: number of its sleeping island
  uint32_t row = 0;             // index among the bodies of its island
  uint32_t rank = 0;            // position in the world's order of bodies; see ActiveBodies
  Real impact_speed_bound = 0;  // greatest speed of a nearby body that may hit it in the sub-step [m/s]

  // The current interval of motion: a whole sub-step, or the rest of it after an impact.
  Real from = 0;  // start of the interval, since the sub-step's start [s]
  Pose start_pose;
  // Velocity at the start of the interval of the centre of mass or, for a kinematic body, of the pose's
  // origin at the start of the sub-step; and angular velocity.
  Twist start_twist;
  Twist drive;  // kinematic bodies: velocity of the pose's origin and angular velocity, at the interval's end
  Real turning = 0;  // see turning_speed()
  RigidState start;  // dynamic bodies: state at the start of the interval

  // State of a dynamic body at the current time, with its mass and inertia, which are constant.
  RigidBody rigid;

  // The current sub-step and sampling time.
  Pose before_substep, before_step;
  Aabb swept;                      // box around its motion in the sub-step, as given to the broad phase
  bool on_cloth = false;           // whether cloth touched it in the last sub-step
  bool has_motion_forces = false;  // whether springs, drag or fields act on it in this sub-step
  HeldMotion held;                 // used if it has motion forces

  SleepMemory sleep;

  /// Prefetches the members that describe the interval.
  void prefetch_interval() const { prefetch(&start_pose, &before_substep); }

  bool is_dynamic() const { return type == MotionType::dynamic; }
  bool is_kinematic() const { return type == MotionType::kinematic; }
  bool collides() const { return def.collides && !absent; }
  bool is_awake() const { return is_dynamic() && !asleep; }
  /// Greatest speed of its surface in the interval due to rotation [m/s]; 0 for a sphere about its centre.
  Real turning_speed() const { return is_awake() || is_kinematic() ? turning : 0; }
  bool can_move() const { return is_awake() || (is_kinematic() && def.track.moves()); }
  /// Pose and velocities of the body's origin at a time near `now`.
  Motion motion(Real now, Real time) const;
  /// Begins an interval at this time.
  void begin_interval(Real time) {
    from = time;
    start = rigid.state();
    start_twist = {rigid.velocity(), rigid.angular_velocity()};
    start_pose = pose;
    set_turning(start_twist.angular_velocity, extent + rigid.centre.norm());
  }
  /// Moves a kinematic body to the end of the interval.
  void drive_to(const Motion& motion) {
    pose = motion.pose;
    drive = {motion.velocity, motion.angular_velocity};
    set_turning(drive.angular_velocity, extent);
  }
  /// Sets the velocities of the centre of mass at the interval's start, after a collision.
  void set_start_velocity(const Vec3& v, const Vec3& w) {
    start.momentum = rigid.mass * v;
    start.angular_momentum = rigid.spin_momentum(start.orientation, w);
    start_twist = {v, w};
    set_turning(w, extent + rigid.centre.norm());
  }
  /// Returns the body in its state at the interval's start.
  RigidBody at_start() const {
    RigidBody body = rigid;
    body.set_state(start);
    return body;
  }
  /// Returns the orientation at which the inertia is evaluated to convert contact and joint impulses of the
  /// interval into velocities. `duration`: length of the interval [s]; `substep`: length of the sub-step that
  /// contains it [s].
  ///
  /// For compact bodies it is the orientation at the interval's end, so that velocities and momenta agree
  /// there. For thin bodies it is the orientation at the time at which the impulses act: in the middle, or at
  /// the start if contact_motion() does not predict the contacts of the body. The terms that the solvers
  /// neglect, I^-1 (dw x I w + w x I dw) h / 2, are then at most h |w| |dw|. With the orientation at the end,
  /// an impulse on a thin rod would make it spin about its axis, with a speed proportional to the ratio of
  /// its moments of inertia.
  Quat impulse_orientation(Real duration, Real substep) const;
  /// Path from the interval's start to the current pose.
  PosePath path() const { return {start_pose, pose}; }
  /// Pose at a time since the start of a sub-step of length h [s]. Times before the interval's start give the
  /// pose at its start.
  Pose placed_at(Real time, Real h) const {
    if (time <= from || !can_move()) return start_pose;
    return path().at((time - from) / (h - from));
  }
  /// Velocity of the body's material point at `place` (world) at the interval's start [m/s].
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

/// Calls work(i) for each body i in parallel, like for_each_index(). Prefetches the data of each body's
/// interval, because bodies are scattered in memory.
template <class Work>
void for_each_interval(std::span<Body* const> bodies, Work&& work) {
  constexpr std::size_t kAhead = 3;
  for_each_index(bodies.size(), [&](std::size_t i) {
    if (i + kAhead < bodies.size()) bodies[i + kAhead]->prefetch_interval();
    work(i);
  });
}

}  // namespace offstage::sim
