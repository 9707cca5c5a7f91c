#include "sim/dynamics/body.h"

#include "sim/dynamics/expected_acceleration.h"
#include "sim/dynamics/free_body.h"

namespace offstage::sim {

const CollisionShape& BodyModel::collision_shape() {
  if (!collision_shape_)
    collision_shape_.emplace(
        solid, CollisionShape::Options{.needs_volume = def.motion == MotionType::dynamic, .tree = tree});
  return *collision_shape_;
}

const CollisionShape& BodyModel::triangle_shape() {
  if (!triangle_shape_)
    triangle_shape_.emplace(solid, CollisionShape::Options{.by_triangles = true, .tree = tree});
  return *triangle_shape_;
}

void HeldMotion::begin_substep(const RigidBody& body) {
  expected_ = expected_acceleration(body, last_).value_or(Twist{});
  last_ = {Twist{}, last_[0], last_[1]};
}

void HeldMotion::add_to(RigidBody& body) {
  added_ = {body.mass * expected_.velocity, body.spin_momentum(body.orientation, expected_.angular_velocity)};
  body.push += added_;
}

void HeldMotion::take_back(RigidBody& body, Real duration) {
  body.push += {-added_.force, -added_.torque};
  body.momentum -= duration * added_.force;
  body.angular_momentum -= duration * added_.torque;
  const Real moved = duration * duration / 2;
  body.position -= moved * expected_.velocity;
  body.orientation = (rotation(expected_.angular_velocity, -moved) * body.orientation).normalized();
}

Motion Body::motion(Real now, Real time) const {
  if (is_kinematic()) return def.track.at(time, def.pose);
  if (!is_dynamic()) return {.pose = pose};
  // The pose is extrapolated with the current velocities.
  const Real dt = time - now;
  const Vec3 v = rigid.velocity(), w = rigid.angular_velocity();
  const Real rate = w.norm();
  RigidBody later = rigid;
  later.position += dt * v;
  if (rate > 0)
    later.orientation = (Quat(Eigen::AngleAxisd(rate * dt, w / rate)) * rigid.orientation).normalized();
  const Vec3 arm = -(later.orientation * rigid.centre);
  return {later.pose(), v + w.cross(arm), w};
}

Quat Body::impulse_orientation(Real duration, Real substep) const {
  if (!rigid.is_thin()) return rigid.orientation;
  const Vec3& w = start_twist.angular_velocity;
  const bool is_predicted = substep * w.norm() <= kMostPredictedTurn;
  return is_predicted ? rotation(w, duration / 2) * start.orientation : start.orientation;
}

}  // namespace offstage::sim
