#include "sim/contact/contact_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "sim/collision/sphere_manifold.h"
#include "sim/contact/contact_motion.h"

namespace offstage::sim {
namespace {

/// Points closer to each other than this are identical, even if their ids differ [m].
constexpr Real kSame = 5e-3;
/// The squared distance of points with equal ids is multiplied by this, so that they are preferred.
constexpr Real kSameFeature = 1.0 / 16;
/// With more points than this, candidates are found by binary search and not compared one by one.
constexpr std::size_t kManyPoints = 16;
/// A contact can continue another one only if the cosine of the angle between their normals is greater than
/// this.
constexpr Real kAlong = 0.7;
/// An overlap at the end of an interval is expected if it exceeds the prediction of an existing point by less
/// than kExpected [m]. This point must be within kNear [m], and the cosine of the angle between the normals
/// must exceed kSameNormal.
constexpr Real kSameNormal = 0.999, kNear = 0.02, kExpected = 2e-4;
/// A layer of cloth that is compressed gets thicker by at most this fraction of its thickness at a time.
constexpr Real kLayerRecovery = 0.05;
/// A layer may be this far beyond the surfaces, in thicknesses: bodies that overlap the cloth.
constexpr Real kLayerReach = 1.2;
/// Cloth slides on a body if its velocity relative to it is greater than this [m/s].
constexpr Real kLayerSlides = 0.01;
/// Fraction of the spread of points that is added to the spread, so that its matrix can be inverted.
constexpr Real kFlat = 1e-6;

Pose between(const Pose& a, const Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

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

Vec3 world_vector(const ContactFrame& f, const Vec3& v) {
  return v.x() * f.n + v.y() * f.t + v.z() * f.k;
}
Vec3 frame_vector(const ContactFrame& f, const Vec3& v) {
  return {f.n.dot(v), f.t.dot(v), f.k.dot(v)};
}

/// A pose for transforming many vectors. Its rotation matrix is computed only once.
struct Frame {
  explicit Frame(const Pose& pose) : position(pose.position), axes(pose.orientation.toRotationMatrix()) {}

  Vec3 point_to_world(const Vec3& p) const { return axes * p + position; }
  Vec3 point_to_body(const Vec3& p) const { return axes.transpose() * (p - position); }
  Vec3 vector_to_world(const Vec3& v) const { return axes * v; }
  Vec3 vector_to_body(const Vec3& v) const { return axes.transpose() * v; }

  Vec3 position;
  Mat3 axes;
};

/// Turns the lines of a manifold into the world. The normal of a face, which is the most frequent one, has
/// none.
void turn_lines(const Manifold& local, const Mat3& axes, Manifold& m) {
  const bool of_a = local.source == NormalSource::edges || local.source == NormalSource::edge_of_a;
  const bool of_b = local.source == NormalSource::edges || local.source == NormalSource::edge_of_b;
  m.edge_a = of_a ? Vec3(axes * local.edge_a) : Vec3(Vec3::Zero());
  m.edge_b = of_b ? Vec3(axes * local.edge_b) : Vec3(Vec3::Zero());
}

/// Transforms a manifold from the frame `from` to the world. Only the existing points are copied.
void place(const Manifold& local, const Pose& from, Manifold& m) {
  const Frame pose(from);
  m.normal = pose.vector_to_world(local.normal);
  m.source = local.source;
  turn_lines(local, pose.axes, m);
  m.radius_a = local.radius_a;
  m.radius_b = local.radius_b;
  m.count = local.count;
  m.piece_a = local.piece_a;
  m.piece_b = local.piece_b;
  m.continues_a = local.continues_a;
  m.continues_b = local.continues_b;
  for (uint32_t k = 0; k < local.count; ++k) {
    const ContactPoint& p = local.points[k];
    m.points[k] = {pose.point_to_world(p.on_a), pose.point_to_world(p.on_b), p.separation, p.id, p.piece};
  }
}

/// Fractions of a force that the points of a manifold get, so that the force acts at `centre` (in a's frame,
/// as `frame`). Their sum is 1. They are linear over the plane of the points, so that their weighted mean is
/// `centre` if it lies among the points.
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
  // The spread of collinear or equal points is singular. The addition does not change the result otherwise.
  spread += kFlat * (spread.trace() + kSame * kSame) * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d slope = -spread.inverse() * middle;
  Weights result{};
  Real sum = 0;
  for (uint32_t k = 0; k < count; ++k)
    sum += result[k] = std::max(0.0, 1.0 / count + slope.dot(at[k] - middle));
  for (Real& w : result) w /= sum;
  return result;
}

/// Corrects the points of a rim over a face. A manifold represents a disc by a polygon. The lowest point of a
/// leaning disc is between two corners, and a corner in its place would make the contact jump along the rim.
/// The corners next to the lowest point are omitted: they touch only because the contact has moved along the
/// rim, and the velocity of the material at the start does not show this motion.
class LeaningRim {
 public:
  /// Prepares the corrections if the shape has a rim. `core`: pose of the shape in the frame of the manifold.
  /// `out`: direction towards the face.
  LeaningRim(const Shape& shape, const Pose& core, const Vec3& out) : core_(core) {
    if (!std::holds_alternative<Cylinder>(shape) && !std::holds_alternative<Cone>(shape) &&
        !std::holds_alternative<Frustum>(shape))
      return;
    const Vec3 facing = core.vector_to_body(out);
    const Real lean = std::hypot(facing.x(), facing.z());
    if (lean > kLeast) facing_ = {facing.x() / lean, facing.z() / lean};
  }
  bool leans() const { return facing_ != Eigen::Vector2d::Zero(); }

  /// Returns a point of the rim. A point near the meridian that faces the other body is moved to this
  /// meridian.
  Vec3 lowered(const Vec3& place) const {
    const Vec3 local = core_.point_to_body(place);
    const Real radius = std::hypot(local.x(), local.z());
    if (towards(local) < kNearest * radius) return place;
    return core_.point_to_world({radius * facing_.x(), local.y(), radius * facing_.y()});
  }
  /// Whether a point is next to the lowest point of the same rim.
  bool is_beside(const Vec3& place, const Vec3& lowest) const {
    const Vec3 local = core_.point_to_body(place), low = core_.point_to_body(lowest);
    const Real radius = std::hypot(low.x(), low.z());
    return towards(low) > kNearest * radius && towards(local) > 0 &&
           std::abs(local.y() - low.y()) < kSameHeight * radius &&
           (local - low).norm() > kSameHeight * radius;
  }

 private:
  /// kNearest: cosine of half the angle between two corners. kLeast: sine of the smallest lean. kSameHeight:
  /// heights that differ by less than this fraction of the radius are equal.
  static constexpr Real kNearest = 0.9951847, kLeast = 0.02, kSameHeight = 1e-6;
  Real towards(const Vec3& local) const { return local.x() * facing_.x() + local.z() * facing_.y(); }

  Pose core_;
  Eigen::Vector2d facing_ = Eigen::Vector2d::Zero();
};

/// Corrects the points of a manifold in a's frame that are on leaning rims.
void follow_rims(Manifold& m, const Body& a, const Body& b, const Pose& a_from_b) {
  const bool on_a = m.source == NormalSource::face_of_b, on_b = m.source == NormalSource::face_of_a;
  if (!on_a && !on_b) return;
  const LeaningRim rim =
      on_a ? LeaningRim(a.def.shape, Pose{}, -m.normal) : LeaningRim(b.def.shape, a_from_b, m.normal);
  if (!rim.leans()) return;
  const auto on_rim = [on_a](ContactPoint& p) -> Vec3& { return on_a ? p.on_a : p.on_b; };
  uint32_t lowest = 0;
  for (uint32_t k = 0; k < m.count; ++k) {
    ContactPoint& p = m.points[k];
    const Vec3 moved = rim.lowered(on_rim(p));
    // The face is flat, so the separation changes by the displacement along the normal.
    p.separation += (on_a ? 1 : -1) * m.normal.dot(moved - on_rim(p));
    on_rim(p) = moved;
    (on_a ? p.on_b : p.on_a) =
        on_a ? Vec3(moved - p.separation * m.normal) : Vec3(moved + p.separation * m.normal);
    if (p.separation < m.points[lowest].separation) lowest = k;
  }
  const Vec3 low = m.count > 0 ? on_rim(m.points[lowest]) : Vec3(Vec3::Zero());
  const uint32_t count = std::exchange(m.count, 0);
  for (uint32_t k = 0; k < count; ++k)
    if (!rim.is_beside(on_rim(m.points[k]), low)) m.points[m.count++] = m.points[k];
}

/// Returns the velocity that the material point at an arm has without contacts: the mean of its velocities at
/// the start and at the end of the interval.
Vec3 free_velocity(const Body& body, const Vec3& arm) {
  if (!body.is_awake()) return body.is_kinematic() ? body.drive.at(arm) : Vec3(Vec3::Zero());
  const Twist mean{(body.start_twist.velocity + body.rigid.velocity()) / 2,
                   (body.start_twist.angular_velocity + body.rigid.angular_velocity()) / 2};
  return mean.at(arm);
}

/// Poses of a body at the start of the interval and, if it moves freely, at its end. Their position is
/// start_centre().
struct Ends {
  explicit Ends(const Body& body)
      : start{start_centre(body), body.is_awake() ? body.start.orientation : body.start_pose.orientation},
        end{body.is_awake() ? body.rigid.position : body.pose.position, body.pose.orientation} {}

  Pose start, end;
};

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
    has_narrow_ |= !on_face && !(m.manifold.continues_a && m.manifold.continues_b) && is_narrow(m.manifold);
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
  if (i < found_.size()) place(m, between(placed_at_, Pose{}), found_[i]);
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
  const Pose a_from_b = between(a, b);
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
    place(found[i], a, placed_[i].manifold);
    set_frame(placed_[i]);
  }
  if (layer_) insert_layers();
  restore_forces(before, a);
  inherit(before, a);
  placed_at_ = a;
  found_.clear();
}

void ContactPair::set_cloth(std::span<const LayerTriangle> cloth) {
  if (cloth.empty()) {
    if (!layer_) return;
    surface_ = layer_->bare;
    layer_.reset();
    found_margin_ = 0;  // the points contain the layer, so they are not reused
    return;
  }
  if (!layer_) layer_ = std::make_unique<PairLayer>(PairLayer{.bare = surface_});
  layer_->cloth = cloth;
  layer_->thickest = std::ranges::max(cloth, {}, &LayerTriangle::thickness).thickness;
}

/// Notes that no contact point is at cloth.
void ContactPair::clear_layers() {
  layer_->places.clear();
  surface_ = layer_->bare;
}

/// Moves the contact points of both bodies towards each other by the distance that cloth between them keeps.
/// Cloth that is compressed to less than this distance gets thicker slowly, as the overlap of bodies is
/// removed slowly. The cloth also determines the surface of the pair: it absorbs impacts, and its friction
/// on both bodies acts between them unless the cloth slides on both.
void ContactPair::insert_layers() {
  PairLayer& layer = *layer_;
  layer.places.clear();
  Real friction = kInfinity, on_a = 0, on_b = 0;  // greatest velocities of the cloth on the bodies
  for (PlacedManifold& placed : placed_) {
    Manifold& m = placed.manifold;
    const Vec3& n = m.normal;
    for (uint32_t k = 0; k < m.count; ++k) {
      ContactPoint& p = m.points[k];
      const Vec3 middle = (p.on_a + p.on_b) / 2;
      const Real reach = std::abs(p.separation) / 2 + kLayerReach * layer.thickest;
      const ClothLayers found = layers_across(layer.cloth, middle, n, reach);
      if (!found.lowest) continue;
      const Real keeps =
          std::min(found.distance, std::max(p.separation, 0.0) + kLayerRecovery * found.distance);
      p.on_a -= keeps / 2 * n;
      p.on_b += keeps / 2 * n;
      p.separation -= keeps;
      const auto slip = [&](const Body& body) {
        const Vec3 relative = found.lowest->velocity - body.start_velocity(middle) -
                              body.start_pose.vector_to_world(body.def.surface_velocity);
        return (relative - n.dot(relative) * n).norm();
      };
      on_a = std::max(on_a, slip(*a_));
      on_b = std::max(on_b, slip(*b_));
      friction = std::min(friction,
                          std::sqrt(found.lowest->friction * std::min(a_->def.friction, b_->def.friction)));
      layer.places.push_back({middle, n, found.lowest->cloth, found.lowest->number});
    }
  }
  surface_ = layer.bare;
  if (layer.places.empty()) return;
  layer.slides = std::min(on_a, on_b) > kLayerSlides;
  const auto inverse_mass = [](const Body& body) { return body.is_dynamic() ? 1 / body.rigid.mass : 0; };
  layer.holds_by_a =
      std::max(on_a, on_b) > kLayerSlides ? on_a < on_b : inverse_mass(*a_) < inverse_mass(*b_);
  surface_.restitution = 0;
  surface_.friction = surface_.static_friction = layer.slides ? 0 : friction;
  surface_.cross = 1;
  surface_.axis_body = nullptr;
  if (layer.slides) surface_.rolling = surface_.spinning = 0;
}

Real ContactPair::free_displacement(const PlacedManifold& m, const Vec3& place, Real gap,
                                    Real duration) const {
  const ContactMotion motion = contact_motion(*a_, *b_, m.manifold, m.frame, place, gap, duration, duration);
  const Vec3 velocity = free_velocity(*a_, motion.middle.arm_a) - free_velocity(*b_, motion.middle.arm_b);
  return duration * motion.frame.n.dot(velocity);
}

/// While a wheel rolls, its contact stays below it and the rim turns. Therefore a point at the interval's end
/// is the same contact as a point at its start if the feature of the start's point has moved there, on either
/// body.
bool ContactPair::predicts(const PlacedManifold& m, const Vec3& normal, const ContactPoint& at_end,
                           Real duration, bool between_points) const {
  const Vec3& n = m.frame.n;
  if (n.dot(normal) < kSameNormal) return false;
  const Ends ends_a(*a_), ends_b(*b_);
  const auto moved = [](const Body& body, const Ends& ends, const Vec3& place, const Vec3& out_before,
                        const Vec3& out_after) {
    return Vec3(ends.end.position + turned_arm(body, place - ends.start.position, ends.start.orientation,
                                               out_before, ends.end.orientation, out_after));
  };
  struct Moved {
    Vec3 on_a, on_b;
    Real separation;
  };
  std::array<Moved, 4> points;
  for (uint32_t k = 0; k < m.manifold.count; ++k) {
    const ContactPoint& p = m.manifold.points[k];
    points[k] = {moved(*a_, ends_a, p.on_a, -n, -normal), moved(*b_, ends_b, p.on_b, n, normal),
                 separation_at_end(m, p, duration)};
  }
  for (uint32_t k = 0; k < m.manifold.count; ++k)
    for (uint32_t l = k; l < (between_points ? m.manifold.count : k + 1); ++l) {
      const auto is_between = [&](const Vec3& from, const Vec3& to, const Vec3& place) {
        const Vec3 segment = to - from;
        const Real length2 = segment.squaredNorm();
        const Real fraction = length2 > 0 ? std::clamp(segment.dot(place - from) / length2, 0.0, 1.0) : 0;
        const Real separation =
            points[k].separation + fraction * (points[l].separation - points[k].separation);
        return (from + fraction * segment - place).squaredNorm() < kNear * kNear &&
               separation < at_end.separation + kExpected;
      };
      if (is_between(points[k].on_a, points[l].on_a, at_end.on_a) ||
          is_between(points[k].on_b, points[l].on_b, at_end.on_b))
        return true;
    }
  return false;
}

/// Returns the contacts at the end of the interval, moved back to its start. Each feature moves with its
/// body.
PlacedManifold ContactPair::moved_back(const Manifold& at_end, Real duration) const {
  const Ends a(*a_), b(*b_);
  const auto back = [](const Ends& body, const Vec3& v) {
    return Vec3(body.start.vector_to_world(body.end.vector_to_body(v)));
  };
  PlacedManifold placed;
  Manifold& m = placed.manifold;
  m = at_end;
  m.edge_a = back(a, at_end.edge_a);
  m.edge_b = back(b, at_end.edge_b);
  if (m.source == NormalSource::face_of_a) m.normal = back(a, at_end.normal);
  if (m.source == NormalSource::face_of_b) m.normal = back(b, at_end.normal);
  set_frame(placed);
  const auto arm = [&](const Body& body, const Ends& ends, const Vec3& place, Real side) {
    return turned_arm(body, place - ends.end.position, ends.end.orientation, side * at_end.normal,
                      ends.start.orientation, side * m.normal);
  };
  // The bodies slide along each other in the interval. The contact moves with the feature that defines it, as
  // in contact_motion(). Otherwise it would be next to the axis of a thin body, and its force would make the
  // body spin.
  const bool by_b = moves_with_b(m.source);
  for (uint32_t k = 0; k < m.count; ++k) {
    ContactPoint& p = m.points[k];
    const Vec3 on_a = a.start.position + arm(*a_, a, p.on_a, -1),
               on_b = b.start.position + arm(*b_, b, p.on_b, 1);
    const Vec3& carrier = by_b ? on_b : on_a;
    const Vec3 middle = carrier + m.normal.dot((on_a + on_b) / 2 - carrier) * m.normal;
    p.separation -= free_displacement(placed, middle, m.normal.dot(on_a - on_b), duration);
    p.on_a = middle + p.separation / 2 * m.normal;
    p.on_b = middle - p.separation / 2 * m.normal;
  }
  return placed;
}

void ContactPair::add_speculative_contacts(Real duration) {
  if (has_sphere_) return;
  const Pose a_from_b = between(a_->pose, b_->pose);
  // At the end, other triangles divide the line on which a cylinder lies.
  const bool between_points = a_->collision_shape().surface() || b_->collision_shape().surface();
  static thread_local std::vector<Manifold> found;
  found.clear();
  cache_.keeps_sides = false;
  find_manifolds(a_->collision_shape(), b_->collision_shape(), a_from_b, 0, cache_, surface_.method, found);
  cache_.keeps_sides = true;
  for (Manifold& local : found) {
    follow_rims(local, *a_, *b_, a_from_b);
    Manifold at_end;
    place(local, a_->pose, at_end);
    const auto is_new = [&](const ContactPoint& p) {
      return p.separation < -kExpected &&
             std::none_of(placed_.begin(), placed_.end(), [&](const PlacedManifold& m) {
               return predicts(m, at_end.normal, p, duration, between_points);
             });
    };
    if (std::none_of(at_end.points.begin(), at_end.points.begin() + at_end.count, is_new)) continue;
    placed_.push_back(moved_back(at_end, duration));
    ++speculative;
    at_end_.push_back(at_end);
    has_narrow_ |= is_narrow(placed_.back().manifold);
  }
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
  const Vec3 last = frame_vector(m.frame, world_vector(before, f.last));
  f = {last, last, frame_vector(m.frame, world_vector(before, f.mean)), true};
}

/// Converts a stored force to a new frame. The normal force stays along the normal even if the bodies have
/// turned far, because they may roll.
PointForce ContactPair::stored_force(const StoredPoint& p, const ContactFrame& frame, const Mat3& a_axes) {
  const auto force = [&](const Vec3& before) -> Vec3 {
    const Real normal = before.dot(p.normal);
    const Vec3 tangential = a_axes * (before - normal * p.normal);
    return {normal, frame.t.dot(tangential), frame.k.dot(tangential)};
  };
  const Vec3 last = force(p.last);
  return {last, last, force(p.mean), true};
}

/// Places the points again for the current poses. They keep their positions on their bodies; the normal keeps
/// its direction in a.
void ContactPair::reuse(const Pose& a, const Pose& b, const std::vector<StoredPoint>& points) {
  if (found_.empty()) {
    found_.resize(placed_.size());
    const Pose to_a = between(placed_at_, Pose{});
    for (std::size_t i = 0; i < placed_.size(); ++i) place(placed_[i].manifold, to_a, found_[i]);
  }
  const Frame frame_a(a), frame_b(b), from_b(a_from_b_);
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

/// Stores the points with their forces in a's frame. The tangents of a contact frame can jump although its
/// normal hardly moves.
void ContactPair::store_points(std::vector<StoredPoint>& points) const {
  if (placed_.empty()) return;
  const Frame at(placed_at_);
  for (const PlacedManifold& m : placed_) {
    const Vec3 normal = at.vector_to_body(m.frame.n);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& p = m.manifold.points[k];
      points.push_back({at.point_to_body(p.on_a), at.vector_to_body(world_vector(m.frame, m.forces[k].last)),
                        at.vector_to_body(world_vector(m.frame, m.forces[k].mean)), normal, m.torque,
                        m.mean_torque, p.id, false});
    }
  }
}

/// Gives the stored forces to the points that existed before, which are recognized by id or else by distance.
/// Each stored force is used once. Otherwise the forces of a pair that is found repeatedly would grow without
/// limit.
void ContactPair::restore_forces(std::vector<StoredPoint>& points, const Pose& pose) {
  const Frame a(pose);
  // Two models of many parts have thousands of points. Then only points that are near along x or have the
  // same id are compared.
  const bool are_many = points.size() > kManyPoints;
  // Points of different pairs of parts may have the same id.
  const Real same_feature = kSame / std::sqrt(kSameFeature);
  static thread_local std::vector<std::pair<Real, uint32_t>> by_x;
  static thread_local std::vector<std::tuple<uint32_t, Real, uint32_t>> by_id;  // sorted by id, and then by x
  if (are_many) {
    by_x.clear();
    by_id.clear();
    for (uint32_t i = 0; i < points.size(); ++i) {
      by_x.emplace_back(points[i].on_a.x(), i);
      by_id.emplace_back(points[i].id, points[i].on_a.x(), i);
    }
    std::sort(by_x.begin(), by_x.end());
    std::sort(by_id.begin(), by_id.end());
  }
  for (PlacedManifold& m : placed_) {
    m.torque = m.mean_torque = 0;
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      m.forces[k] = {};
      const ContactPoint& point = m.manifold.points[k];
      const Vec3 on_a = a.point_to_body(point.on_a);
      StoredPoint* best = nullptr;
      Real nearest = kSame * kSame;
      const auto compare = [&](StoredPoint& p) {
        const Real distance = (p.on_a - on_a).squaredNorm() * (p.id == point.id ? kSameFeature : 1);
        // The first of several equally near points is used.
        if (p.taken || distance > nearest || (distance == nearest && (!best || best < &p))) return;
        nearest = distance;
        best = &p;
      };
      if (are_many) {
        for (auto at = std::lower_bound(by_x.begin(), by_x.end(), std::pair(on_a.x() - kSame, 0u));
             at != by_x.end() && at->first <= on_a.x() + kSame; ++at)
          compare(points[at->second]);
        for (auto at = std::lower_bound(by_id.begin(), by_id.end(),
                                        std::tuple(point.id, on_a.x() - same_feature, 0u));
             at != by_id.end() && std::get<0>(*at) == point.id && std::get<1>(*at) <= on_a.x() + same_feature;
             ++at)
          compare(points[std::get<2>(*at)]);
      } else {
        for (StoredPoint& p : points) compare(p);
      }
      if (!best) continue;
      best->taken = true;
      m.forces[k] = stored_force(*best, m.frame, a.axes);
      m.torque = best->torque;
      m.mean_torque = best->mean_torque;
    }
  }
}

/// Transfers the forces of points that have disappeared to the current points. Faces that lie on each other
/// may have different corners in every step, but their load does not change. The forces go to the first
/// manifold with a similar normal. They are distributed over its points so that their sum acts where it did,
/// as far as the points extend.
void ContactPair::inherit(std::vector<StoredPoint>& points, const Pose& a) {
  static thread_local std::vector<StoredPoint*> left;
  left.clear();
  for (StoredPoint& p : points)
    if (!p.taken && !(p.last.isZero(0) && p.mean.isZero(0))) left.push_back(&p);
  if (left.empty()) return;
  for (PlacedManifold& m : placed_) {
    const ContactFrame frame{a.vector_to_body(m.frame.n), a.vector_to_body(m.frame.t),
                             a.vector_to_body(m.frame.k)};
    Vec3 force = Vec3::Zero(), mean = Vec3::Zero(), moment = Vec3::Zero();
    Real pressure = 0;
    for (StoredPoint* remembered : left) {
      StoredPoint& p = *remembered;
      // Directions are kept in the world, even if a rolling body has turned far.
      const Vec3 before = placed_at_.vector_to_world(p.normal);
      if (p.taken || !(before.dot(m.frame.n) > kAlong)) continue;
      const auto along_normal = [&](const Vec3& f) {
        const Real normal = f.dot(p.normal);
        return Vec3(normal * frame.n +
                    a.vector_to_body(placed_at_.vector_to_world(Vec3(f - normal * p.normal))));
      };
      p.taken = true;
      force += along_normal(p.last);
      mean += along_normal(p.mean);
      const Real normal = p.last.dot(p.normal);
      moment += normal * p.on_a;
      pressure += normal;
    }
    if (pressure == 0) continue;
    const Weights fractions = weights(m.manifold, frame, a, moment / pressure);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      m.forces[k].last += fractions[k] * frame_vector(frame, force);
      m.forces[k].mean += fractions[k] * frame_vector(frame, mean);
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
