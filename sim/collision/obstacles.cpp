#include "sim/collision/obstacles.h"

#include <algorithm>
#include <cmath>

#include "sim/core/twist.h"

namespace offstage::sim {
namespace {

constexpr int kMaxPieces = 16;

}  // namespace

Obstacle::Obstacle(const Solid& shape, const Pose& from, const Pose& to, Real duration, Real e, Real mu)
    : solid(shape), extent(reach(shape)), restitution(e), friction(mu) {
  set_path(from, to, duration);
}

void Obstacle::set_path(const Pose& from, const Pose& to, Real duration) {
  start = from;
  end = to;
  velocity = angular_velocity = Vec3::Zero();
  turn = 0;
  if (from.position != to.position) velocity = (to.position - from.position) / duration;
  if (from.orientation.coeffs() == to.orientation.coeffs()) return;
  Quat rotation = to.orientation * from.orientation.conjugate();
  if (rotation.w() < 0) rotation.coeffs() = -rotation.coeffs();
  const Eigen::AngleAxisd axis_angle(rotation);
  angular_velocity = axis_angle.angle() / duration * axis_angle.axis();
  if (from.orientation.dot(end.orientation) < 0) end.orientation.coeffs() = -end.orientation.coeffs();
  if (!std::holds_alternative<Sphere>(*solid.shape)) turn = axis_angle.angle();
}

Pose Obstacle::at(Real fraction) const {
  if (turn > 0) return turned_at(fraction);
  return {start.position + fraction * (end.position - start.position), start.orientation};
}

Pose Obstacle::turned_at(Real fraction) const {
  Pose pose{start.position + fraction * (end.position - start.position), start.orientation};
  if (angular_velocity != Vec3::Zero())
    pose.orientation.coeffs() =
        ((1 - fraction) * start.orientation.coeffs() + fraction * end.orientation.coeffs()).normalized();
  return pose;
}

Vec3 Obstacle::friction_axis_on(const Vec3& n, Real fraction) const {
  if (cross_friction == 1 || friction_axis.isZero()) return Vec3::Zero();
  const Vec3 axis = at(fraction).vector_to_world(friction_axis), along = axis - n.dot(axis) * n;
  const Real length = along.norm();
  if (length < 1e-6 * axis.norm()) return Vec3::Zero();  // the axis is perpendicular to the surface
  return along / length;
}

Vec3 Obstacle::conveying_velocity(const Vec3& n, Real fraction) const {
  if (surface_velocity == Vec3::Zero()) return surface_velocity;
  const Vec3 v = at(fraction).vector_to_world(surface_velocity);
  return v - n.dot(v) * n;
}

Mat3 Obstacle::mobility(const Vec3& arm) const {
  return point_mobility(inverse_mass, inverse_inertia, arm);
}

int Obstacle::pieces(Real particle_radius) const {
  if (turn == 0) return 1;
  // An arc of angle a and radius R deviates from its chord by R a^2 / 8.
  const Real count = turn * std::sqrt(extent / (8 * kChordError * particle_radius));
  return count < kMaxPieces ? std::max(1, static_cast<int>(std::ceil(count))) : kMaxPieces;
}

Aabb Obstacle::swept_bounds() const {
  if (turn == 0) return bounds(solid, start).merged(bounds(solid, end));
  const Vec3 around = Vec3::Constant(extent);
  return {start.position.cwiseMin(end.position) - around, start.position.cwiseMax(end.position) + around};
}

Obstacles::Obstacles(std::vector<Obstacle> obstacles) : obstacles_(std::move(obstacles)) {
  for (uint32_t i = 0; i < obstacles_.size(); ++i) {
    const Obstacle& o = obstacles_[i];
    if (std::holds_alternative<Plane>(*o.solid.shape)) {
      const Vec3 n0 = o.start.vector_to_world(Vec3::UnitY()), n1 = o.end.vector_to_world(Vec3::UnitY());
      planes_.push_back({n0, n1, n0.dot(o.start.position), n1.dot(o.end.position), i});
    } else {
      boxed_.push_back(i);
      boxes_.push_back(o.swept_bounds());
    }
  }
  tree_ = AabbTree(boxes_);
}

void Obstacles::move_end(const Obstacle& of, const Pose& end, Real h) {
  Obstacle& moved = obstacles_.at(static_cast<std::size_t>(&of - obstacles_.data()));
  moved.set_path(moved.start, end, h);
}

}  // namespace offstage::sim
