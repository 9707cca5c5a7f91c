#include "sim/collision/triangle_contact.h"

#include <algorithm>
#include <cmath>

#include "sim/collision/collision_mesh.h"
#include "sim/collision/contact_candidates.h"
#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

/// The normal of a face that approaches a ridge may be outside of the ridge's region by up to this fraction
/// of the ridge's slope, because the face may turn into the region within the step.
constexpr Real kGuard = 0.5;
/// The surface beyond an edge is a valley if it rises there by more than this sine, and a ridge if it falls.
constexpr Real kValley = 1e-3;

/// Greatest depth at which a face pushes a solid, as a multiple of the depth below a neighbouring face or
/// along another normal that the surface allows. A solid at a ridge is about equally deep below both faces;
/// one that comes over the ridge is deeper below the face that it has not reached, by orders of magnitude.
constexpr Real kMuchDeeper = 2;

/// Returns the depth of the deepest point [m]; negative if all points are separate, or if there are none.
Real deepest(const Manifold& m) {
  Real least = kInfinity;
  for (uint32_t k = 0; k < m.count; ++k) least = std::min(least, m.points[k].separation);
  return -least;
}

/// Returns, by side, the distance by which the other solid may be beyond the triangle's side and still count
/// as in front of its face. Beyond a valley the plane of the face continues below the surface, which stops
/// the solid first.
std::array<Real, 3> room_beyond(const SurfaceTriangle& t, Real margin) {
  std::array<Real, 3> room{};
  for (std::size_t k = 0; k < 3; ++k)
    if (t.fall(k) < -kValley) room[k] = margin;
  return room;
}

/// One of the two pieces, if it is a triangle.
struct TriangleSide {
  SurfaceTriangle triangle;
  Pose a_from_mesh;
  bool of_b;

  bool gives_normal(const Manifold& m) const {
    return m.source == (of_b ? NormalSource::face_of_b : NormalSource::face_of_a);
  }
  /// Whether the other piece's face gives the normal.
  bool takes_normal(const Manifold& m) const {
    return m.source == (of_b ? NormalSource::face_of_a : NormalSource::face_of_b);
  }
  /// Returns the normal that points away from the triangle, in the mesh's frame.
  Vec3 outward(const Vec3& normal) const { return a_from_mesh.vector_to_body(of_b ? normal : Vec3(-normal)); }

  /// Removes the points at which the surface does not allow the normal. Returns whether there were any.
  bool restrict(Manifold& m) const {
    const Vec3 n = outward(m.normal);
    const uint32_t count = m.count;
    if (gives_normal(m)) {
      if (n.dot(triangle.normal()) < 0) m.count = 0;
      return m.count < count;
    }
    m.count = 0;
    if (n.dot(triangle.normal()) < -kNearFace) return true;
    for (uint32_t k = 0; k < count; ++k) {
      const Vec3 point = a_from_mesh.point_to_body(of_b ? m.points[k].on_b : m.points[k].on_a);
      if (triangle.allows(point, n, takes_normal(m) ? kGuard : 0)) m.points[m.count++] = m.points[k];
    }
    return m.count < count;
  }
};

/// Returns the greatest depth below its face at which a triangle may push another solid [m]. A body on a
/// stair is far behind the plane of the riser, but just above the ridge: a solid that is much less deep below
/// the face beyond a ridge, or along the normals in `found`, has come over an edge of the triangle. `other`:
/// the solid, with its pose in A's frame.
Real greatest_depth(const TriangleSide& side, const Convex& other, const Pose& a_from_other,
                    std::span<const Manifold> found) {
  Real least = kInfinity;
  for (const Manifold& m : found)
    if (m.count > 0) least = std::min(least, deepest(m));
  const SurfaceTriangle& t = side.triangle;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(t.fall(k) > kValley)) continue;
    const Vec3 up = side.a_from_mesh.vector_to_world(t.neighbour(k).normal());
    uint32_t start = 0;
    const Vec3 lowest = a_from_other.point_to_world(other.support(-a_from_other.vector_to_body(up), start));
    const Vec3 edge = side.a_from_mesh.point_to_world(t.corner(k));
    least = std::min(least, other.radius - up.dot(lowest - edge));
  }
  return kMuchDeeper * std::max(least, 0.0);
}

}  // namespace

void sphere_triangle_manifold(const Vec3& centre, Real radius, const SurfaceTriangle& triangle,
                              const Pose& mesh_pose, bool of_b, Real margin, Manifold& m) {
  m.count = 0;
  const Vec3 p = mesh_pose.point_to_body(centre), up = triangle.normal();
  const TrianglePoint nearest =
      closest_on_triangle(p, triangle.corner(0), triangle.corner(1), triangle.corner(2));
  const Vec3 away = p - nearest.point;
  const Real distance = away.norm(), height = up.dot(p - triangle.corner(0));
  if (distance - radius > margin) return;

  // The number of vertices of weight 0, the last of them, and the last of the other vertices.
  std::size_t excluded = 0, without = 0, with = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    (nearest.weights[k] == 0 ? without : with) = k;
    excluded += nearest.weights[k] == 0;
  }
  // If the sphere penetrates the surface, its centre may be on the other side of the triangle.
  const bool through = height < 0 && distance < radius;
  const SurfaceTriangle seen{triangle.mesh, triangle.face, height < 0 ? -triangle.side : triangle.side};
  Vec3 outward = up;
  Real separation = height - radius;
  Vec3 edge = Vec3::Zero();
  m.source = of_b ? NormalSource::face_of_b : NormalSource::face_of_a;
  m.radius_a = m.radius_b = 0;
  if (excluded > 0 && distance > 0) {
    const Vec3 direction = away / distance;
    if (seen.allows(nearest.point, direction)) {
      outward = through ? Vec3(-direction) : direction;
      separation = through ? -distance - radius : distance - radius;
      if (excluded == 1) edge = (triangle.corner(without + 2) - triangle.corner(without + 1)).normalized();
      m.source = excluded == 2 ? NormalSource::points
                 : of_b        ? NormalSource::edge_of_b
                               : NormalSource::edge_of_a;
      (of_b ? m.radius_a : m.radius_b) = radius;
    } else {
      // The sphere is in front of the plane of a face, beyond a valley.
      const std::array<Real, 3> room = room_beyond(triangle, margin);
      const std::size_t k = excluded == 1 ? (without + 1) % 3 : room[with] > 0 ? with : (with + 2) % 3;
      if ((away - height * up).squaredNorm() > room[k] * room[k] || !(separation <= margin)) return;
    }
  }
  const Vec3 n = mesh_pose.vector_to_world(outward);
  m.normal = of_b ? n : Vec3(-n);
  const Vec3 along = mesh_pose.vector_to_world(edge);
  m.edge_a = of_b ? Vec3(Vec3::Zero()) : along;
  m.edge_b = of_b ? along : Vec3(Vec3::Zero());
  const Vec3 on_sphere = centre - radius * n, on_mesh = on_sphere - separation * n;
  m.points[m.count++] = {of_b ? on_sphere : on_mesh, of_b ? on_mesh : on_sphere, separation,
                         vertex_id(of_b ? 0 : 1, 0)};
}

void find_triangle_manifolds(const Convex& a, const Convex& b, const PairTriangles& triangles,
                             const Pose& a_from_b, const Separation& s, Real margin, bool turning,
                             std::vector<Manifold>& found) {
  if (!(s.distance <= margin)) return;
  std::array<TriangleSide, 2> sides;
  std::size_t count = 0;
  if (triangles.b) sides[count++] = {*triangles.b, a_from_b, true};
  if (triangles.a) sides[count++] = {*triangles.a, Pose{}, false};

  const std::size_t before = found.size();
  std::optional<MoreManifolds> more;
  if (turning) more.emplace();
  found.push_back(manifold(a, b, a_from_b, s, margin, more ? &*more : nullptr));
  if (more)
    for (const Manifold& m : more->manifolds)
      if (m.count > 0) found.push_back(m);
  for (std::size_t i = 0; i < count; ++i) {
    const TriangleSide& side = sides[i];
    bool restricted = false;
    for (std::size_t k = before; k < found.size(); ++k) restricted |= side.restrict(found[k]);
    if (!restricted) continue;
    const Vec3 up = side.a_from_mesh.vector_to_world(side.triangle.normal());
    const Real most = side.of_b ? greatest_depth(side, a, Pose{}, std::span(found).subspan(before))
                                : greatest_depth(side, b, a_from_b, std::span(found).subspan(before));
    const Manifold face =
        triangle_face_manifold(a, b, a_from_b, side.of_b, up, room_beyond(side.triangle, margin), margin);
    if (deepest(face) <= most + kRim * margin) found.push_back(face);
  }
  found.erase(std::remove_if(found.begin() + static_cast<std::ptrdiff_t>(before), found.end(),
                             [](const Manifold& m) { return m.count == 0; }),
              found.end());
}

}  // namespace offstage::sim
