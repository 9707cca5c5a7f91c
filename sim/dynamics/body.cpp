#include "sim/dynamics/body.h"

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

namespace {

/// Greatest change of an acceleration in a sub-step, relative to its value, that can be extrapolated. A
/// greater one is an impact, or a contact that begins or ends.
constexpr Real kResolved = 0.5;

Twist operator-(const Twist& a, const Twist& b) {
  return {a.velocity - b.velocity, a.angular_velocity - b.angular_velocity};
}

}  // namespace

void HeldMotion::begin_substep(const RigidBody& body) {
  const auto product = [&](const Twist& a, const Twist& b) {  // in the metric of masses
    return body.mass * a.velocity.dot(b.velocity) +
           body.spin_momentum(body.orientation, a.angular_velocity).dot(b.angular_velocity);
  };
  const Twist last = last_[0], slope = last - last_[1], slope_before = last_[1] - last_[2];
  expected_ = {};
  if (product(slope, slope) <= kResolved * kResolved * product(last, last)) {
    // Without a slope the acceleration would lag behind an oscillation, and springs would add energy to it.
    expected_ = last;
    if (product(slope, slope_before) > 0) {
      const bool is_smaller = product(slope, slope) < product(slope_before, slope_before);
      const Twist& smaller = is_smaller ? slope : slope_before;
      expected_.velocity += smaller.velocity;
      expected_.angular_velocity += smaller.angular_velocity;
    }
  }
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
