#include "sim/cloth/cloth_bodies.h"

namespace offstage::sim {
namespace {

/// A pose moved by a shift of its point `centre` (body frame) and a small turn about it.
Pose moved(const Pose& pose, const Vec3& centre, const Vec3& shift, const Vec3& turn) {
  if (shift == Vec3::Zero() && turn == Vec3::Zero()) return pose;
  const Vec3 place = pose.point_to_world(centre) + shift;
  const Quat q(1, turn.x() / 2, turn.y() / 2, turn.z() / 2);
  Pose result;
  result.orientation = (q * pose.orientation).normalized();
  result.position = place - result.vector_to_world(centre);
  return result;
}

}  // namespace

ClothBody::ClothBody(const Obstacle& way, Real h, const Vec3& velocity, const Vec3& angular_velocity,
                     const Vec3& surface_velocity)
    : way_(way),
      h_(h),
      velocity_(velocity),
      angular_velocity_(angular_velocity),
      surface_velocity_(surface_velocity),
      reaction_{way.body, Vec3::Zero(), Vec3::Zero()} {}

void ClothBody::begin(Real from, Real to, Real dt) {
  start_ = moved(way_.at(from), way_.centre, shift_, turn_);
  shift_ += dt * gained_;
  turn_ += dt * gained_spin_;
  end_ = moved(way_.at(to), way_.centre, shift_, turn_);
  centre_ = end_.point_to_world(way_.centre);
  dt_ = dt;
  to_ = to;
}

Vec3 ClothBody::surface_motion(const Vec3& p) const {
  Vec3 motion = p - start_.point_to_world(end_.point_to_body(p));
  if (way_.turn == 0 && way_.angular_velocity != Vec3::Zero())  // a sphere, whose turning its way leaves out
    motion += dt_ * way_.angular_velocity.cross(p - end_.position);
  if (surface_velocity_ != Vec3::Zero()) motion += dt_ * end_.vector_to_world(surface_velocity_);
  return motion;
}

Real ClothBody::mobility(const Vec3& p, const Vec3& n) const {
  if (!is_dynamic()) return 0;
  const Vec3 turning = (p - centre_).cross(n);
  return way_.inverse_mass + turning.dot(way_.inverse_inertia * turning);
}

void ClothBody::push(const Vec3& impulse, const Vec3& p) {
  touched = true;
  if (!is_dynamic()) return;
  const Vec3 turning = (p - centre_).cross(impulse);
  reaction_.impulse += impulse;
  reaction_.angular_impulse += turning;
  const Vec3 dv = way_.inverse_mass * impulse, dw = way_.inverse_inertia * turning;
  velocity_ += dv;
  angular_velocity_ += dw;
  gained_ += dv;
  gained_spin_ += dw;
}

void ClothBody::load(const Vec3& impulse, const Vec3& p) {
  if (!pin_load_) pin_load_ = Reaction{way_.body, Vec3::Zero(), Vec3::Zero()};
  pin_load_->impulse += impulse;
  pin_load_->angular_impulse += (p - centre_).cross(impulse);
}

void ClothBody::pull(const Vec3& impulse, const Vec3& p, Real share) {
  const Vec3 gained = gained_, gained_spin = gained_spin_;
  push(impulse, p);
  shift_ += share * dt_ * (gained_ - gained);
  turn_ += share * dt_ * (gained_spin_ - gained_spin);
  end_ = moved(way_.at(to_), way_.centre, shift_, turn_);
}

}  // namespace offstage::sim
