#include "sim/contact/contact_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/collision/sphere_manifold.h"
#include "sim/contact/manifold_placing.h"

namespace offstage::sim {
namespace {

/// Returns an upper bound of the distance that a point of a solid moves from one pose to another. `reach`:
/// greatest distance of its points from the centre.
Real difference(const Pose& p, const Pose& q, Real reach) {
  const Real half_sine = (p.orientation.coeffs() - q.orientation.coeffs()).norm();
  return (p.position - q.position).norm() + 2 * half_sine * reach;
}

bool is_sphere_pair(Body& a, Body& b) {
  const CollisionShape &p = a.collision_shape(), &q = b.collision_shape();
  if (p.is_plane() || q.is_plane() || p.piece_count() != 1 || q.piece_count() != 1) return false;
  return is_sphere_pair(p.piece(0), q.piece(0));
}

bool is_ball(const Body& body) {
  return std::holds_alternative<Sphere>(body.def.shape);
}

/// Whether the surface has no edges.
bool is_round(const Body& body) {
  return std::holds_alternative<Sphere>(body.def.shape) || std::holds_alternative<Capsule>(body.def.shape);
}

}  // namespace

bool is_narrow(const Manifold& m) {
  if (m.count < 3) return true;
  constexpr Real kNarrow = 5e-3;  // [m]
  Real area = 0, longest2 = 0;
  for (uint32_t k = 1; k < m.count; ++k) {
    const Vec3 arm = m.points[k].on_a - m.points[0].on_a;
    longest2 = std::max(longest2, arm.squaredNorm());
    for (uint32_t i = k + 1; i < m.count; ++i)
      area = std::max(area, std::abs(m.normal.dot(arm.cross(m.points[i].on_a - m.points[0].on_a))));
  }
  return area <= kNarrow * std::sqrt(longest2);
}

Manifold near_deepest(const Manifold& m) {
  Real least = std::numeric_limits<Real>::infinity();
  for (uint32_t k = 0; k < m.count; ++k) least = std::min(least, m.points[k].separation);
  Manifold near = m;
  near.count = 0;
  for (uint32_t k = 0; k < m.count; ++k)
    if (m.points[k].separation <= least + kInclined) near.points[near.count++] = m.points[k];
  return near;
}

ContactPair::ContactPair(Body& a, Body& b, const PairSurface& surface)
    : a_(&a),
      b_(&b),
      surface_(surface),
      is_on_plane_(b.collision_shape().is_plane()),
      has_sphere_(is_sphere_pair(a, b)) {
  if (!surface.by_triangles) return;
  // The shapes are created here, because pairs are processed in parallel.
  for (Body* body : {&a, &b}) body->triangle_shape();
}

void ContactPair::find(const Pose& a, const Pose& b, Real margin, Real reuse_within, bool turning) {
  find_points(a, b, margin, reuse_within, turning);
  separation_ = std::numeric_limits<Real>::infinity();
  touching_ = 0;
  speculative = 0;
  at_end_.clear();
  has_narrow_ = false;
  for (const PlacedManifold& m : placed_) {
    // Edges of a face have no effect on a ball that lies on the face.
    const bool on_face = (m.manifold.source == NormalSource::face_of_b && is_ball(*a_)) ||
                         (m.manifold.source == NormalSource::face_of_a && is_ball(*b_));
    // Only a body that lies on immovable ones may pass over edges that it does not touch (internal_edges.h).
    const bool may_pass = !a_->is_dynamic() || !b_->is_dynamic();
    has_narrow_ |= !on_face && !(m.manifold.continues_a && m.manifold.continues_b) &&
                   is_narrow(may_pass ? near_deepest(m.manifold) : m.manifold);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const Real separation = m.manifold.points[k].separation;
      separation_ = std::min(separation_, separation);
      touching_ += separation <= kTouching;
    }
  }
  deepest = std::max(deepest, -separation_);
}

void ContactPair::replace(uint32_t i, const Manifold& m) {
  placed_[i].manifold = m;
  if (i < found_.size()) place_manifold(m, relative_pose(placed_at_, Pose{}), found_[i]);
  if (m.count == 0) return;
  set_frame(placed_[i]);
  placed_[i].forces = {};
}

void ContactPair::drop_empty() {
  const auto is_empty = [](const Manifold& m) { return m.count == 0; };
  const std::size_t known = placed_.size() - speculative;
  for (std::size_t i = 0, kept = 0; i < speculative; ++i)
    if (!is_empty(placed_[known + i].manifold)) at_end_[kept++] = at_end_[i];
  const auto speculative_left = static_cast<std::size_t>(
      std::count_if(placed_.begin() + static_cast<std::ptrdiff_t>(known), placed_.end(),
                    [&](const PlacedManifold& m) { return !is_empty(m.manifold); }));
  speculative = static_cast<uint8_t>(speculative_left);
  at_end_.resize(speculative);
  std::erase_if(found_, is_empty);
  std::erase_if(placed_, [&](const PlacedManifold& m) { return is_empty(m.manifold); });
}

void ContactPair::find_points(const Pose& a, const Pose& b, Real margin, Real reuse_within, bool turning) {
  const Real apart = a_->extent + b_->extent + margin;
  if ((a.position - b.position).squaredNorm() > apart * apart) {
    placed_.clear();
    found_margin_ = 0;
    if (layer_) clear_layers();
    return;
  }
  if (layer_) reuse_within = 0;  // cloth moves
  if (has_sphere_) {
    found_margin_ = margin;
    placed_at_ = a;
    return find_one_point(a, b, margin);
  }
  // Pairs are processed in parallel, so the buffers belong to the threads.
  static thread_local std::vector<StoredPoint> before;
  static thread_local std::vector<Manifold> found;
  const Pose a_from_b = relative_pose(a, b);
  before.clear();
  store_points(before);
  const Real reach_b = is_on_plane_ ? a_->extent + a_from_b.position.norm() : b_->extent;
  if (found_margin_ >= margin && found_margin_ <= 4 * margin && reuse_within > 0 &&
      difference(a_from_b, a_from_b_, reach_b) <= reuse_within) {
    reuse(a, b, before);
    return;
  }
  found.clear();
  find_manifolds(a_->collision_shape(), b_->collision_shape(), a_from_b, margin, cache_, surface_.method,
                 found, turning);
  cache_.forget_unused();
  for (Manifold& m : found) follow_rims(m, *a_, *b_, a_from_b);
  a_from_b_ = a_from_b;
  found_margin_ = margin;
  placed_.resize(found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    place_manifold(found[i], a, placed_[i].manifold);
    set_frame(placed_[i]);
  }
  if (layer_) insert_layers();
  restore_forces(before, a);
  inherit(before, a);
  placed_at_ = a;
  found_.clear();
}

/// Finds the contact of a pair with a sphere. The stored force keeps its direction in the world, because a
/// rolling sphere turns while the force does not.
void ContactPair::find_one_point(const Pose& a, const Pose& b, Real margin) {
  const bool known = !placed_.empty();
  placed_.resize(1);
  PlacedManifold& m = placed_.front();
  m.manifold.continues_a = is_round(*a_);
  m.manifold.continues_b = is_round(*b_);
  sphere_manifold(a_->collision_shape().piece(0), a, b_->collision_shape().piece(0), b, margin, m.manifold);
  if (m.manifold.count == 0) {
    if (layer_) clear_layers();
    return placed_.clear();
  }
  const ContactFrame before = m.frame;
  set_frame(m);
  if (layer_) insert_layers();
  if (!known) return;
  PointForce& f = m.forces[0];
  const Vec3 last = m.frame.components(before.vector(f.last));
  f = {last, last, m.frame.components(before.vector(f.mean)), true};
}

/// Places the points again for the current poses. They keep their positions on their bodies; the normal keeps
/// its direction in a.
void ContactPair::reuse(const Pose& a, const Pose& b, const std::vector<StoredPoint>& points) {
  if (found_.empty()) {
    found_.resize(placed_.size());
    const Pose to_a = relative_pose(placed_at_, Pose{});
    for (std::size_t i = 0; i < placed_.size(); ++i) place_manifold(placed_[i].manifold, to_a, found_[i]);
  }
  const PoseMatrix frame_a(a), frame_b(b), from_b(a_from_b_);
  std::size_t next = 0;
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const Manifold& local = found_[i];
    PlacedManifold& placed = placed_[i];
    Manifold& m = placed.manifold;
    m.normal = frame_a.vector_to_world(local.normal);
    turn_lines(local, frame_a.axes, m);
    set_frame(placed);
    for (uint32_t k = 0; k < local.count; ++k) {
      const Vec3 on_a = frame_a.point_to_world(local.points[k].on_a);
      const Vec3 on_b = frame_b.point_to_world(from_b.point_to_body(local.points[k].on_b));
      m.points[k].separation = m.normal.dot(on_a - on_b);
      // Both points are on one line along the normal, through the midpoint of their positions on both bodies.
      const Vec3 middle = (on_a + on_b) / 2;
      m.points[k].on_a = middle + m.points[k].separation / 2 * m.normal;
      m.points[k].on_b = middle - m.points[k].separation / 2 * m.normal;
      placed.forces[k] = stored_force(points[next++], placed.frame, frame_a.axes);
    }
  }
  placed_at_ = a;
}

void ContactPair::set_frame(PlacedManifold& m) const {
  m.frame = contact_frame(m.manifold.normal);
  if (!surface_.axis_body) return;
  const Vec3& n = m.frame.n;
  const Vec3 axis = surface_.axis_body->start_pose.vector_to_world(surface_.axis_body->def.friction_axis);
  const Vec3 along = axis - n.dot(axis) * n;
  const Real length = along.norm();
  if (length < 1e-6 * axis.norm()) return;  // the friction axis is perpendicular to the contact
  m.frame.t = along / length;
  m.frame.k = n.cross(m.frame.t);
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
