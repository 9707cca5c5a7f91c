#include "sim/dynamics/body.h"

namespace offstage::sim {

const CollisionShape& Body::collision_shape() {
  if (!collision_shape_) collision_shape_.emplace(solid, def.motion == MotionType::dynamic);
  return *collision_shape_;
}

Motion Body::motion(Real now, Real time) const {
  if (is_kinematic()) return def.track.at(time, def.pose);
  if (!is_dynamic()) return {.pose = pose};
  // Extrapolated with the current velocities.
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

Mat3 Body::impulse_inverse_inertia(Real substep) const {
  Quat when = start.orientation;
  if (start_twist.angular_velocity.norm() * substep <= kMostPredictedTurn) {
    const Eigen::Vector4d &first = start.orientation.coeffs(), &last = rigid.orientation.coeffs();
    when.coeffs() =
        (first.dot(last) < 0 ? Eigen::Vector4d(first - last) : Eigen::Vector4d(first + last)).normalized();
  }
  const Mat3 axes = when.toRotationMatrix();
  return axes * rigid.inverse_inertia * axes.transpose();
}

}  // namespace offstage::sim
