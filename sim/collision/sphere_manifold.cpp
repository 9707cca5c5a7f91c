#include "sim/collision/sphere_manifold.h"

#include <algorithm>
#include <cmath>

#include "sim/collision/contact_candidates.h"

namespace offstage::sim {
namespace {

using Core = Convex::Core;

/// If a point is nearer to a core than this fraction of the size, the direction between them is undefined.
constexpr Real kNoDirection = 1e-12;

/// The nearest point on the surface of a core, in the core's frame.
struct Nearest {
  enum class Kind : uint8_t { face, edge, point };
  Kind kind = Kind::point;
  Real distance = 0;              ///< negative inside [m]
  Vec3 outward = Vec3::UnitY();   ///< unit, towards the query point
  Vec3 edge = Vec3::Zero();       ///< unit direction of the edge, if the point is on one
  uint32_t tag = 0, end_tag = 0;  ///< tag of the vertex, or tags of both ends of the edge
};

Nearest nearest_to_point(const Vec3& p) {
  Nearest n;
  n.distance = p.norm();
  if (n.distance > 0) n.outward = p / n.distance;
  return n;
}

Nearest nearest_to_segment(Real half, const Vec3& p) {
  const bool upper = p.y() > 0;
  Nearest n = nearest_to_point(p - Vec3(0, std::clamp(p.y(), -half, half), 0));
  n.tag = upper && half > 0;
  if (std::abs(p.y()) > half || !(half > 0)) return n;
  n.kind = Nearest::Kind::edge;
  n.edge = Vec3::UnitY();
  n.tag = 0;
  n.end_tag = 1;
  if (n.distance == 0) n.outward = Vec3::UnitX();
  return n;
}

Nearest nearest_inside_box(const Vec3& half, const Vec3& p) {
  int axis;
  Nearest n;
  n.kind = Nearest::Kind::face;
  n.distance = (p.cwiseAbs() - half).maxCoeff(&axis);
  n.outward = std::copysign(1, p[axis]) * Vec3::Unit(axis);
  return n;
}

Nearest nearest_to_box(const Vec3& half, const Vec3& p) {
  const Vec3 beyond = p - p.cwiseMin(half).cwiseMax(-half);
  Nearest n = nearest_to_point(beyond);
  if (n.distance <= kNoDirection * half.maxCoeff()) return nearest_inside_box(half, p);
  int outside = 0;
  for (int k = 0; k < 3; ++k) {
    outside += beyond[k] != 0;
    n.tag |= uint32_t{p[k] > 0} << k;
  }
  if (outside == 1) n.kind = Nearest::Kind::face;
  if (outside != 2) return n;
  n.kind = Nearest::Kind::edge;
  for (int k = 0; k < 3; ++k)
    if (beyond[k] == 0) {
      n.edge = Vec3::Unit(k);
      n.end_tag = n.tag ^ 1u << k;
    }
  return n;
}

Nearest nearest(const Convex& c, const Vec3& p) {
  if (c.core == Core::box) return nearest_to_box(c.half, p);
  return c.core == Core::segment ? nearest_to_segment(c.half.y(), p) : nearest_to_point(p);
}

/// Returns the id of a contact of the sphere's centre with this feature.
uint32_t contact_id(const Nearest& n, uint32_t other) {
  const uint32_t sphere = vertex_id(1 - other, 0);
  if (n.kind == Nearest::Kind::face) return sphere;
  const uint32_t feature =
      n.kind == Nearest::Kind::edge ? edge_id(n.tag, n.end_tag) : vertex_id(other, n.tag);
  return other == 0 ? mixed(feature, sphere) : mixed(sphere, feature);
}

void set_source(Manifold& m, const Nearest& n, uint32_t other, const Vec3& edge) {
  if (n.kind == Nearest::Kind::point) return;
  const bool is_a = other == 0;
  if (n.kind == Nearest::Kind::face) {
    m.source = is_a ? NormalSource::face_of_a : NormalSource::face_of_b;
    m.radius_a = m.radius_b = 0;
    return;
  }
  m.source = is_a ? NormalSource::edge_of_a : NormalSource::edge_of_b;
  (is_a ? m.edge_a : m.edge_b) = edge;
}

}  // namespace

bool is_sphere_pair(const Convex& a, const Convex& b) {
  const auto is_known = [](const Convex& c) {
    return c.core == Core::point || c.core == Core::segment || (c.core == Core::box && c.radius == 0);
  };
  if (a.place || b.place) return false;
  return (a.core == Core::point && is_known(b)) || (b.core == Core::point && is_known(a));
}

void sphere_manifold(const Convex& a, const Pose& pose_a, const Convex& b, const Pose& pose_b, Real margin,
                     Manifold& m) {
  const uint32_t other = b.core == Core::point ? 0 : 1;
  const Pose& pose = other == 0 ? pose_a : pose_b;
  const Vec3& centre = other == 0 ? pose_b.position : pose_a.position;
  const Nearest n = nearest(other == 0 ? a : b, pose.point_to_body(centre));
  const Real separation = n.distance - a.radius - b.radius;
  m.count = 0;
  if (!(separation <= margin)) return;
  const Vec3 outward = pose.vector_to_world(n.outward);
  m.source = NormalSource::points;
  m.normal = other == 0 ? Vec3(-outward) : outward;
  m.radius_a = a.radius;
  m.radius_b = b.radius;
  set_source(m, n, other, pose.vector_to_world(n.edge));
  // The points are computed from the sphere's centre.
  ContactPoint& p = m.points[m.count++];
  p.separation = separation;
  p.id = contact_id(n, other);
  if (other == 0) {
    p.on_b = centre + b.radius * m.normal;
    p.on_a = p.on_b + separation * m.normal;
  } else {
    p.on_a = centre - a.radius * m.normal;
    p.on_b = p.on_a - separation * m.normal;
  }
}

}  // namespace offstage::sim
