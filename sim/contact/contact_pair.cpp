#include "sim/contact/contact_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/collision/sphere_manifold.h"

namespace offstage::sim {
namespace {

/// Points that are this near to each other are the same, whatever their features are called [m].
constexpr Real kSame = 5e-3;
/// Of squared distances: points of the same features count as so much nearer.
constexpr Real kSameFeature = 1.0 / 16;
/// Cosine: a force that is not more inclined than this belongs to the normal. With a coefficient of friction
/// of 1 it is 45 degrees away at most.
constexpr Real kAlong = 0.7;
/// What overlaps at an interval's end by less than kForeseen, or than a point tells that has a normal as
/// alike as this cosine and is so near, is expected [m].
constexpr Real kSameNormal = 0.999, kNear = 0.02, kForeseen = 2e-4;
/// Of the spread of points, what makes it invertible.
constexpr Real kFlat = 1e-6;

Pose between(const Pose& a, const Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

/// How far any point of a solid of the given reach is moved by the difference of two poses.
Real difference(const Pose& p, const Pose& q, Real reach) {
  const Real half_sine = (p.orientation.coeffs() - q.orientation.coeffs()).norm();
  return (p.position - q.position).norm() + 2 * half_sine * reach;
}

bool is_sphere_pair(Body& a, Body& b) {
  const CollisionShape &p = a.collision_shape(), &q = b.collision_shape();
  if (p.is_plane() || q.is_plane() || p.piece_count() != 1 || q.piece_count() != 1) return false;
  return is_sphere_pair(p.piece(0), q.piece(0));
}

Vec3 world_vector(const ContactFrame& f, const Vec3& v) {
  return v.x() * f.n + v.y() * f.t + v.z() * f.k;
}
Vec3 frame_vector(const ContactFrame& f, const Vec3& v) {
  return {f.n.dot(v), f.t.dot(v), f.k.dot(v)};
}

/// Copies no more than the points that there are.
void place(const Manifold& local, const Pose& pose, Manifold& m) {
  m.normal = pose.vector_to_world(local.normal);
  m.source = local.source;
  m.edge_a = pose.vector_to_world(local.edge_a);
  m.edge_b = pose.vector_to_world(local.edge_b);
  m.radius_a = local.radius_a;
  m.radius_b = local.radius_b;
  m.count = local.count;
  for (uint32_t k = 0; k < local.count; ++k) {
    const ContactPoint& p = local.points[k];
    m.points[k] = {pose.point_to_world(p.on_a), pose.point_to_world(p.on_b), p.separation, p.id};
  }
}

/// By points: shares of a force at `centre`, in a's frame like `frame`. They make a sum of 1 and, if the
/// place is among the points, have their centre there: linear over the plane of the points.
using Weights = std::array<Real, 4>;
Weights weights(const Manifold& m, const ContactFrame& frame, const Pose& a, const Vec3& centre) {
  const uint32_t count = m.count;
  std::array<Eigen::Vector2d, 4> at;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (uint32_t k = 0; k < count; ++k) {
    const Vec3 p = a.point_to_body(m.points[k].on_a) - centre;
    at[k] = {frame.t.dot(p), frame.k.dot(p)};
    middle += at[k] / count;
  }
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (uint32_t k = 0; k < count; ++k) spread += (at[k] - middle) * (at[k] - middle).transpose();
  // In a line, or at one place, the spread has no inverse: a little more of it does not matter.
  spread += kFlat * (spread.trace() + kSame * kSame) * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d slope = -spread.inverse() * middle;
  Weights result{};
  Real sum = 0;
  for (uint32_t k = 0; k < count; ++k)
    sum += result[k] = std::max(0.0, 1.0 / count + slope.dot(at[k] - middle));
  for (Real& w : result) w /= sum;
  return result;
}

/// Of the material point that is at a place of the world when the interval begins, without contacts: the mean
/// of its ends.
Vec3 free_velocity(const Body& body, const Vec3& place) {
  if (!body.is_awake()) return body.start_velocity(place);
  const Twist mean{(body.start_twist.velocity + body.rigid.velocity()) / 2,
                   (body.start_twist.angular_velocity + body.rigid.angular_velocity()) / 2};
  return mean.at(place - body.start.position);
}

}  // namespace

ContactPair::ContactPair(Body& a, Body& b, const PairSurface& surface)
    : a_(&a),
      b_(&b),
      surface_(surface),
      is_on_plane_(b.collision_shape().is_plane()),
      has_sphere_(is_sphere_pair(a, b)) {}

void ContactPair::find(const Pose& a, const Pose& b, Real margin, Real reuse_within, bool turning) {
  find_points(a, b, margin, reuse_within, turning);
  separation_ = std::numeric_limits<Real>::infinity();
  touching_ = 0;
  foreseen = 0;
  for (const PlacedManifold& m : placed_)
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const Real separation = m.manifold.points[k].separation;
      separation_ = std::min(separation_, separation);
      touching_ += separation <= kTouching;
    }
}

void ContactPair::find_points(const Pose& a, const Pose& b, Real margin, Real reuse_within, bool turning) {
  const Real apart = a_->extent + b_->extent + margin;
  if ((a.position - b.position).squaredNorm() > apart * apart) {
    placed_.clear();
    found_margin_ = 0;
    return;
  }
  if (has_sphere_) {
    found_margin_ = margin;
    return find_one_point(a, b, margin);
  }
  // Pairs are found side by side; what they need for a moment is each thread's own.
  static thread_local std::vector<Remembered> before;
  static thread_local std::vector<Manifold> found;
  const Pose a_from_b = between(a, b);
  before.clear();
  remember(before);
  const Real reach_b = is_on_plane_ ? a_->extent + a_from_b.position.norm() : b_->extent;
  if (found_margin_ >= margin && found_margin_ <= 4 * margin && reuse_within > 0 &&
      difference(a_from_b, a_from_b_, reach_b) <= reuse_within) {
    reuse(a, b, before);
    return;
  }
  found.clear();
  find_manifolds(a_->collision_shape(), b_->collision_shape(), a_from_b, margin, cache_, DistanceMethod::gjk,
                 found, turning);
  cache_.forget_unused();
  a_from_b_ = a_from_b;
  found_margin_ = margin;
  placed_.resize(found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    place(found[i], a, placed_[i].manifold);
    set_frame(placed_[i]);
  }
  recall(before, a);
  inherit(before, a);
  placed_at_ = a;
  found_.clear();
}

Vec3 ContactPair::free_way(const Vec3& point, Real duration) const {
  return duration * (free_velocity(*a_, point) - free_velocity(*b_, point));
}

bool ContactPair::is_expected(const Vec3& normal, const Vec3& on_a, Real separation, Real duration) const {
  for (const PlacedManifold& m : placed_) {
    if (m.frame.n.dot(normal) < kSameNormal) continue;
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& p = m.manifold.points[k];
      if ((p.on_a - on_a).squaredNorm() > kNear * kNear) continue;
      if (p.separation + m.frame.n.dot(free_way(p.on_a, duration)) < separation + kForeseen) return true;
    }
  }
  return false;
}

void ContactPair::foresee(Real duration) {
  if (has_sphere_) return;
  static thread_local std::vector<Manifold> found;
  const Pose &a = a_->start_pose, &b = b_->start_pose, end = between(a_->pose, b_->pose);
  found.clear();
  find_manifolds(a_->collision_shape(), b_->collision_shape(), end, 0, cache_, DistanceMethod::gjk, found);
  for (const Manifold& at_end : found) {
    PlacedManifold placed;
    Manifold& m = placed.manifold;
    place(at_end, a_->pose, m);
    bool is_new = false;
    for (uint32_t k = 0; k < m.count; ++k) {
      const Real separation = at_end.points[k].separation;
      const Vec3 on_a = a.point_to_world(at_end.points[k].on_a),
                 on_b = b.point_to_world(end.point_to_body(at_end.points[k].on_b)),
                 middle = (on_a + on_b) / 2;
      is_new |= separation < -kForeseen && !is_expected(m.normal, on_a, separation, duration);
      ContactPoint& p = m.points[k];
      p.separation = separation - m.normal.dot(free_way(middle, duration));
      p.on_a = middle + p.separation / 2 * m.normal;
      p.on_b = middle - p.separation / 2 * m.normal;
    }
    if (!is_new) continue;
    set_frame(placed);
    placed_.push_back(placed);
    ++foreseen;
  }
}

/// Of a sphere. Its force stays as it is in the world, for the sphere turns under it when it rolls.
void ContactPair::find_one_point(const Pose& a, const Pose& b, Real margin) {
  const bool known = !placed_.empty();
  placed_.resize(1);
  PlacedManifold& m = placed_.front();
  sphere_manifold(a_->collision_shape().piece(0), a, b_->collision_shape().piece(0), b, margin, m.manifold);
  if (m.manifold.count == 0) return placed_.clear();
  const ContactFrame before = m.frame;
  set_frame(m);
  if (!known) return;
  PointForce& f = m.forces[0];
  const Vec3 last = frame_vector(m.frame, world_vector(before, f.last));
  f = {last, last, frame_vector(m.frame, world_vector(before, f.mean)), true};
}

PointForce ContactPair::recalled(const Remembered& p, const ContactFrame& frame, const Pose& a) {
  const Vec3 last = frame_vector(frame, a.vector_to_world(p.last));
  return {last, last, frame_vector(frame, a.vector_to_world(p.mean)), true};
}

/// The points stay where they are on their bodies; the normal stays with a.
void ContactPair::reuse(const Pose& a, const Pose& b, const std::vector<Remembered>& points) {
  if (found_.empty()) {
    found_.resize(placed_.size());
    const Pose to_a = between(placed_at_, Pose{});
    for (std::size_t i = 0; i < placed_.size(); ++i) place(placed_[i].manifold, to_a, found_[i]);
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const Manifold& local = found_[i];
    PlacedManifold& placed = placed_[i];
    Manifold& m = placed.manifold;
    m.normal = a.vector_to_world(local.normal);
    m.edge_a = a.vector_to_world(local.edge_a);
    m.edge_b = a.vector_to_world(local.edge_b);
    set_frame(placed);
    for (uint32_t k = 0; k < local.count; ++k) {
      const Vec3 on_a = a.point_to_world(local.points[k].on_a);
      const Vec3 on_b = b.point_to_world(a_from_b_.point_to_body(local.points[k].on_b));
      m.points[k].separation = m.normal.dot(on_a - on_b);
      // Both on one line along the normal, halfway between what each body says.
      const Vec3 middle = (on_a + on_b) / 2;
      m.points[k].on_a = middle + m.points[k].separation / 2 * m.normal;
      m.points[k].on_b = middle - m.points[k].separation / 2 * m.normal;
      placed.forces[k] = recalled(points[next++], placed.frame, a);
    }
  }
  placed_at_ = a;
}

void ContactPair::set_frame(PlacedManifold& m) const {
  m.frame = contact_frame(m.manifold.normal);
  if (!surface_.grain) return;
  const Vec3& n = m.frame.n;
  const Vec3 axis = surface_.grain->start_pose.vector_to_world(surface_.grain->def.friction_axis);
  const Vec3 along = axis - n.dot(axis) * n;
  const Real length = along.norm();
  if (length < 1e-6 * axis.norm()) return;  // the grain stands on the contact
  m.frame.t = along / length;
  m.frame.k = n.cross(m.frame.t);
}

/// Forces turn with body a. (A frame's tangents can jump while its normal hardly moves.)
void ContactPair::remember(std::vector<Remembered>& points) const {
  for (const PlacedManifold& m : placed_)
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& p = m.manifold.points[k];
      points.push_back({placed_at_.point_to_body(p.on_a),
                        placed_at_.vector_to_body(world_vector(m.frame, m.forces[k].last)),
                        placed_at_.vector_to_body(world_vector(m.frame, m.forces[k].mean)), m.torque,
                        m.mean_torque, p.id, false});
    }
}

/// Points that were there before keep their forces: those of the same features, or else nearby. Each force
/// goes to one point, or the forces of a pair that is found anew again and again would grow without end.
void ContactPair::recall(std::vector<Remembered>& points, const Pose& a) {
  for (PlacedManifold& m : placed_) {
    m.torque = m.mean_torque = 0;
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      m.forces[k] = {};
      const ContactPoint& point = m.manifold.points[k];
      const Vec3 on_a = a.point_to_body(point.on_a);
      Remembered* best = nullptr;
      Real nearest = kSame * kSame;
      for (Remembered& p : points) {
        const Real distance = (p.on_a - on_a).squaredNorm() * (p.id == point.id ? kSameFeature : 1);
        if (p.taken || distance >= nearest) continue;
        nearest = distance;
        best = &p;
      }
      if (!best) continue;
      best->taken = true;
      m.forces[k] = recalled(*best, m.frame, a);
      m.torque = best->torque;
      m.mean_torque = best->mean_torque;
    }
  }
}

/// What acted at points that are gone goes on to act at those that came for them: faces that lie on each
/// other may have other corners in every step, and what they bear does not change by that. Of the first
/// manifold along whose normal it is, each point gets a share, so that the sum acts where it did, as far as
/// the points reach.
void ContactPair::inherit(std::vector<Remembered>& points, const Pose& a) {
  for (PlacedManifold& m : placed_) {
    const ContactFrame frame{a.vector_to_body(m.frame.n), a.vector_to_body(m.frame.t),
                             a.vector_to_body(m.frame.k)};
    Vec3 force = Vec3::Zero(), mean = Vec3::Zero(), moment = Vec3::Zero();
    Real pressure = 0;
    for (Remembered& p : points) {
      const Real normal = p.last.dot(frame.n);
      if (p.taken || !(normal > kAlong * p.last.norm())) continue;
      p.taken = true;
      force += p.last;
      mean += p.mean;
      moment += normal * p.on_a;
      pressure += normal;
    }
    if (pressure == 0) continue;
    const Weights shares = weights(m.manifold, frame, a, moment / pressure);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      m.forces[k].last += shares[k] * frame_vector(frame, force);
      m.forces[k].mean += shares[k] * frame_vector(frame, mean);
    }
  }
}

Real ContactPair::speed_bound() const {
  const auto velocity = [](const Body& body) {
    return body.is_awake()       ? body.start_twist.velocity
           : body.is_kinematic() ? body.drive.velocity
                                 : Vec3(Vec3::Zero());
  };
  return (velocity(*a_) - velocity(*b_)).norm() + turning_speed();
}

Vec3 ContactPair::relative_velocity(const Vec3& point) const {
  return a_->start_velocity(point) - b_->start_velocity(point);
}

}  // namespace offstage::sim
