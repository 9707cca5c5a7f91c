#include "sim/contact/manifold_placing.h"

#include <cmath>
#include <utility>

#include "sim/contact/round_surface.h"

namespace offstage::sim {
namespace {

/// Corrects the points of a rim over a face. A manifold represents a disc by a polygon. The lowest point of a
/// leaning disc is between two corners, and a corner in its place would make the contact jump along the rim.
/// The corners next to the lowest point are omitted: they touch only because the contact has moved along the
/// rim, and the velocity of the material at the start does not show this motion.
class LeaningRim {
 public:
  /// Prepares the corrections if the surface has a sharp rim. `body`: pose of the body in the frame of the
  /// manifold. `out`: direction towards the face.
  LeaningRim(const RoundSurface& surface, const Pose& body, const Vec3& out)
      : core_{body.point_to_world(surface.place.position), body.orientation * surface.place.orientation} {
    if (!surface.is_revolved() || surface.around > 0) return;
    const Vec3 facing = core_.vector_to_body(out);
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

}  // namespace

void turn_lines(const Manifold& local, const Mat3& axes, Manifold& m) {
  const bool of_a = local.source == NormalSource::edges || local.source == NormalSource::edge_of_a;
  const bool of_b = local.source == NormalSource::edges || local.source == NormalSource::edge_of_b;
  m.edge_a = of_a ? Vec3(axes * local.edge_a) : Vec3(Vec3::Zero());
  m.edge_b = of_b ? Vec3(axes * local.edge_b) : Vec3(Vec3::Zero());
}

void place_manifold(const Manifold& local, const Pose& from, Manifold& m) {
  const PoseMatrix pose(from);
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

void follow_rims(Manifold& m, const Body& a, const Body& b, const Pose& a_from_b) {
  const bool on_a = m.source == NormalSource::face_of_b, on_b = m.source == NormalSource::face_of_a;
  if (!on_a && !on_b) return;
  const LeaningRim rim = on_a ? LeaningRim(round_surface(a, m.piece_a), Pose{}, -m.normal)
                              : LeaningRim(round_surface(b, m.piece_b), a_from_b, m.normal);
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

}  // namespace offstage::sim
