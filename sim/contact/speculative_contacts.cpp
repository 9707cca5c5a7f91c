/// The part of ContactPair that adds contacts which are expected at the end of an interval.

#include <algorithm>
#include <array>

#include "sim/contact/contact_motion.h"
#include "sim/contact/contact_pair.h"
#include "sim/contact/manifold_placing.h"

namespace offstage::sim {
namespace {

/// An overlap at the end of an interval is expected if it exceeds the prediction of an existing point by less
/// than kExpected [m]. This point must be within kNear [m], and the cosine of the angle between the normals
/// must exceed kSameNormal.
constexpr Real kSameNormal = 0.999, kNear = 0.02, kExpected = 2e-4;

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
  const RoundSurface surface_a = round_surface(*a_, m.manifold.piece_a),
                     surface_b = round_surface(*b_, m.manifold.piece_b);
  const auto moved = [](const RoundSurface& surface, const Ends& ends, const Vec3& place,
                        const Vec3& out_before, const Vec3& out_after) {
    return Vec3(ends.end.position + turned_arm(surface, place - ends.start.position, ends.start.orientation,
                                               out_before, ends.end.orientation, out_after));
  };
  struct Moved {
    Vec3 on_a, on_b;
    Real separation;
  };
  std::array<Moved, 4> points;
  for (uint32_t k = 0; k < m.manifold.count; ++k) {
    const ContactPoint& p = m.manifold.points[k];
    points[k] = {moved(surface_a, ends_a, p.on_a, -n, -normal), moved(surface_b, ends_b, p.on_b, n, normal),
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
  const auto arm = [&](const RoundSurface& body, const Ends& ends, const Vec3& place, Real side) {
    return turned_arm(body, place - ends.end.position, ends.end.orientation, side * at_end.normal,
                      ends.start.orientation, side * m.normal);
  };
  // The bodies slide along each other in the interval. The contact moves with the feature that defines it, as
  // in contact_motion(). Otherwise it would be next to the axis of a thin body, and its force would make the
  // body spin.
  const bool by_b = moves_with_b(m.source);
  for (uint32_t k = 0; k < m.count; ++k) {
    ContactPoint& p = m.points[k];
    const Vec3 on_a = a.start.position + arm(round_surface(*a_, m.piece_a), a, p.on_a, -1),
               on_b = b.start.position + arm(round_surface(*b_, m.piece_b), b, p.on_b, 1);
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
  const Pose a_from_b = relative_pose(a_->pose, b_->pose);
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
    place_manifold(local, a_->pose, at_end);
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

}  // namespace offstage::sim
