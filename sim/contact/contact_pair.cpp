#include "sim/contact/contact_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace offstage::sim {
namespace {

/// Points that are this near to each other are the same, whatever their features are called [m].
constexpr Real kSame = 5e-3;

Pose between(const Pose& a, const Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

/// How far any point of a solid of the given reach is moved by the difference of two poses.
Real difference(const Pose& p, const Pose& q, Real reach) {
  const Real half_sine = (p.orientation.coeffs() - q.orientation.coeffs()).norm();
  return (p.position - q.position).norm() + 2 * half_sine * reach;
}

}  // namespace

void ContactPair::clear() {
  placed_.clear();
  found_.clear();
  found_margin_ = -1;
}

void ContactPair::find(const Pose& a, const Pose& b, Real margin, Real reuse_within) {
  const Pose a_from_b = between(a, b);
  const Real reach_b = b_->collision_shape().is_plane() ? a_->extent + a_from_b.position.norm() : b_->extent;
  if (found_margin_ >= margin && found_margin_ <= 4 * margin && reuse_within > 0 &&
      difference(a_from_b, a_from_b_, reach_b) <= reuse_within) {
    reuse(a, b);
    return;
  }
  std::swap(before_, placed_);
  found_.clear();
  find_manifolds(a_->collision_shape(), b_->collision_shape(), a_from_b, margin, cache_, DistanceMethod::gjk,
                 found_);
  cache_.forget_unused();
  a_from_b_ = a_from_b;
  found_margin_ = margin;
  placed_.resize(found_.size());
  for (std::size_t i = 0; i < found_.size(); ++i) placed_[i] = {.manifold = placed(found_[i], a)};
  set_frames();
  for (PlacedManifold& m : placed_) {
    m.force.fill(Vec3::Zero());
    m.mean_force.fill(Vec3::Zero());
  }
  recall(before_, placed_at_, a);
  placed_at_ = a;
}

/// The points stay where they are on their bodies; the normal stays with a.
void ContactPair::reuse(const Pose& a, const Pose& b) {
  before_frames_.clear();
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const Manifold& local = found_[i];
    Manifold& m = placed_[i].manifold;
    placed_[i].known.fill(true);
    before_frames_.push_back(placed_[i].frame);
    m.normal = a.vector_to_world(local.normal);
    m.edge_a = a.vector_to_world(local.edge_a);
    m.edge_b = a.vector_to_world(local.edge_b);
    for (uint32_t k = 0; k < local.count; ++k) {
      const Vec3 on_a = a.point_to_world(local.points[k].on_a);
      const Vec3 on_b = b.point_to_world(a_from_b_.point_to_body(local.points[k].on_b));
      m.points[k].separation = m.normal.dot(on_a - on_b);
      // Both on one line along the normal, halfway between what each body says.
      const Vec3 middle = (on_a + on_b) / 2;
      m.points[k].on_a = middle + m.points[k].separation / 2 * m.normal;
      m.points[k].on_b = middle - m.points[k].separation / 2 * m.normal;
    }
  }
  set_frames();
  const Quat turn = a.orientation * placed_at_.orientation.conjugate();
  for (std::size_t i = 0; i < placed_.size(); ++i)
    for (uint32_t k = 0; k < placed_[i].manifold.count; ++k)
      for (Vec3* f : {&placed_[i].force[k], &placed_[i].mean_force[k]})
        *f = carried(*f, before_frames_[i], placed_[i].frame, turn);
  placed_at_ = a;
}

/// Forces of an old frame in a new one: they turn with body a. (A frame's tangents can jump while its normal
/// hardly moves.)
Vec3 ContactPair::carried(const Vec3& force, const ContactFrame& old, const ContactFrame& now,
                          const Quat& turn) {
  const Vec3 f = turn * (force.x() * old.n + force.y() * old.t + force.z() * old.k);
  return {now.n.dot(f), now.t.dot(f), now.k.dot(f)};
}

void ContactPair::set_frames() {
  for (PlacedManifold& m : placed_) {
    m.frame = contact_frame(m.manifold.normal);
    if (!surface_.grain) continue;
    const Vec3& n = m.frame.n;
    const Vec3 axis = surface_.grain->start_pose.vector_to_world(surface_.grain->def.friction_axis);
    const Vec3 along = axis - n.dot(axis) * n;
    const Real length = along.norm();
    if (length < 1e-6 * axis.norm()) continue;  // the grain stands on the contact
    m.frame.t = along / length;
    m.frame.k = n.cross(m.frame.t);
  }
}

/// Points that were there before keep their forces: those of the same features, or else nearby.
void ContactPair::recall(const std::vector<PlacedManifold>& before, const Pose& a_before, const Pose& a) {
  if (before.empty()) return;
  const Quat turn = a.orientation * a_before.orientation.conjugate();
  for (PlacedManifold& m : placed_) {
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Vec3 on_a = a.point_to_body(point.on_a);
      Real best = kSame;
      for (const PlacedManifold& old : before)
        for (uint32_t j = 0; j < old.manifold.count; ++j) {
          const ContactPoint& p = old.manifold.points[j];
          const Real distance =
              (a_before.point_to_body(p.on_a) - on_a).norm() * (p.id == point.id ? 0.25 : 1);
          if (distance >= best) continue;
          best = distance;
          m.force[k] = carried(old.force[j], old.frame, m.frame, turn);
          m.mean_force[k] = carried(old.mean_force[j], old.frame, m.frame, turn);
          m.known[k] = true;
          m.torque = old.torque;
          m.mean_torque = old.mean_torque;
        }
    }
  }
}

Real ContactPair::separation() const {
  Real least = std::numeric_limits<Real>::infinity();
  for (const PlacedManifold& m : placed_)
    for (uint32_t k = 0; k < m.manifold.count; ++k) least = std::min(least, m.manifold.points[k].separation);
  return least;
}

Real ContactPair::speed_bound() const {
  const auto speed = [](const Body& body) {
    if (body.is_awake())
      return body.start.angular_velocity().norm() * (body.extent + body.start.centre.norm());
    return body.is_kinematic() && body.drive.angular_velocity != Vec3::Zero()
               ? body.drive.angular_velocity.norm() * body.extent
               : 0.0;
  };
  const auto velocity = [](const Body& body) {
    return body.is_awake()       ? body.start.velocity()
           : body.is_kinematic() ? body.drive.velocity
                                 : Vec3(Vec3::Zero());
  };
  return (velocity(*a_) - velocity(*b_)).norm() + speed(*a_) + speed(*b_);
}

Vec3 ContactPair::relative_velocity(const Vec3& point) const {
  return a_->start_velocity(point) - b_->start_velocity(point);
}

}  // namespace offstage::sim
