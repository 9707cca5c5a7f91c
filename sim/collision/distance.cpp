#include "sim/collision/distance.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace offstage::sim {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

using Vec2 = Eigen::Vector2d;

/// v / |v|, or `fallback` where there is no direction.
Vec3 direction(const Vec3& v, const Vec3& fallback) {
  const Real norm = v.norm();
  return norm > 0 ? Vec3(v / norm) : fallback;
}

/// A figure of revolution about Y seen in its half plane: (distance from the axis, height).
Vec2 to_profile(const Vec3& p) {
  return {std::sqrt(p.x() * p.x() + p.z() * p.z()), p.y()};
}

Vec3 from_profile(const Vec2& n, const Vec3& p, Real rho) {
  return rho > 0 ? Vec3(n.x() * p.x() / rho, n.y(), n.x() * p.z() / rho) : Vec3(n.x(), n.y(), 0);
}

Vec2 closest_on_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 ab = b - a;
  return a + std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) * ab;
}

struct ProfileDistance {
  Real distance;
  Vec2 normal;
};

/// From two faces that bound a convex profile: inside by the nearer face's line, outside by the nearer
/// closest point.
ProfileDistance profile_distance(const Vec2& p, Real above_1, const Vec2& normal_1, const Vec2& closest_1,
                                 Real above_2, const Vec2& normal_2, const Vec2& closest_2) {
  if (above_1 <= 0 && above_2 <= 0)
    return above_1 > above_2 ? ProfileDistance{above_1, normal_1} : ProfileDistance{above_2, normal_2};
  const bool first = (p - closest_1).squaredNorm() < (p - closest_2).squaredNorm();
  const Vec2 away = p - (first ? closest_1 : closest_2);
  const Real distance = away.norm();
  return {distance, distance > 0 ? Vec2(away / distance) : (first ? normal_1 : normal_2)};
}

/// The pseudonormal of the feature of a face that holds a point with these barycentric weights.
Vec3 feature_normal(const CollisionMesh& m, uint32_t face, const std::array<Real, 3>& w) {
  const Triangle& t = m.mesh.triangles[face];
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
    if (w[next] == 0 && w[last] == 0) return m.topology.vertex_normal(t[k]);
  }
  for (std::size_t k = 0; k < 3; ++k)
    if (w[(k + 2) % 3] == 0) return m.topology.edge_normal(m.topology.face_edges(face)[k]);
  return m.topology.face_normal(face);
}

Real support_of(const Sphere& s, const Vec3& n) {
  return s.radius * n.norm();
}
Real support_of(const Box& b, const Vec3& n) {
  return n.cwiseAbs().dot(b.size) / 2;
}
Real support_of(const Capsule& c, const Vec3& n) {
  return std::abs(n.y()) * c.height / 2 + c.radius * n.norm();
}
Real support_of(const Cylinder& c, const Vec3& n) {
  return std::abs(n.y()) * c.height / 2 + c.radius * to_profile(n).x();
}
Real support_of(const Cone& c, const Vec3& n) {
  return std::max(n.y() * c.height / 2, c.radius * to_profile(n).x() - n.y() * c.height / 2);
}
Real support_of(const Plane&, const Vec3& n) {
  return n.x() == 0 && n.z() == 0 && n.y() >= 0 ? 0 : kInfinity;
}

std::vector<Aabb> triangle_boxes(const TriangleMesh& mesh) {
  std::vector<Aabb> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    Aabb box;
    for (uint32_t v : t) box.extend(mesh.vertices[v]);
    boxes.push_back(box);
  }
  return boxes;
}

}  // namespace

static Real farthest(const TriangleMesh& mesh) {
  Real r2 = 0;
  for (const Vec3& v : mesh.vertices) r2 = std::max(r2, v.squaredNorm());
  return std::sqrt(r2);
}

CollisionMesh::CollisionMesh(TriangleMesh welded)
    : mesh(std::move(welded)),
      topology(mesh),
      mass(mass_properties(mesh)),
      tree(triangle_boxes(mesh)),
      reach(farthest(mesh)),
      solid(topology.defects().closed() && !topology.defects().inverted) {}

// Voronoi regions of the triangle, after Ericson, "Real-Time Collision Detection" (2005), 5.1.5.
TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const Real d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
             d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return {a, {1, 0, 0}};
  if (d3 >= 0 && d4 <= d3) return {b, {0, 1, 0}};
  if (d6 >= 0 && d5 <= d6) return {c, {0, 0, 1}};
  const Real vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const Real t = d1 / (d1 - d3);
    return {a + t * ab, {1 - t, t, 0}};
  }
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const Real t = d2 / (d2 - d6);
    return {a + t * ac, {1 - t, 0, t}};
  }
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const Real t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {b + t * (c - b), {0, 1 - t, t}};
  }
  const Real sum = va + vb + vc, v = vb / sum, w = vc / sum;
  return {a + v * ab + w * ac, {1 - v - w, v, w}};
}

SurfaceDistance signed_distance(const Sphere& s, const Vec3& p) {
  return {p.norm() - s.radius, direction(p, Vec3::UnitY())};
}

SurfaceDistance signed_distance(const Box& b, const Vec3& p) {
  const Vec3 beyond = p.cwiseAbs() - b.size / 2;
  const auto sign = [&](int i) { return p[i] < 0 ? -1.0 : 1.0; };
  int axis;
  const Real nearest_face = beyond.maxCoeff(&axis);
  if (nearest_face <= 0) return {nearest_face, sign(axis) * Vec3::Unit(axis)};
  const Vec3 outside = beyond.cwiseMax(0);
  const Real distance = outside.norm();
  return {distance, Vec3(sign(0) * outside.x(), sign(1) * outside.y(), sign(2) * outside.z()) / distance};
}

SurfaceDistance signed_distance(const Capsule& c, const Vec3& p) {
  const Vec3 away = p - Vec3(0, std::clamp(p.y(), -c.height / 2, c.height / 2), 0);
  return {away.norm() - c.radius, direction(away, Vec3::UnitX())};
}

SurfaceDistance signed_distance(const Cylinder& c, const Vec3& p) {
  const Vec2 q = to_profile(p);
  const Real side = q.y() < 0 ? -1 : 1, half = c.height / 2;
  const Vec2 rim(c.radius, side * half);
  const auto [distance, n] = profile_distance(
      q, q.x() - c.radius, Vec2::UnitX(), closest_on_segment(q, Vec2(c.radius, -half), Vec2(c.radius, half)),
      std::abs(q.y()) - half, Vec2(0, side), closest_on_segment(q, Vec2(0, rim.y()), rim));
  return {distance, from_profile(n, p, q.x())};
}

SurfaceDistance signed_distance(const Cone& c, const Vec3& p) {
  const Vec2 q = to_profile(p);
  const Vec2 apex(0, c.height / 2), rim(c.radius, -c.height / 2);
  const Vec2 slant_normal = Vec2(c.height, c.radius).normalized();
  const auto [distance, n] =
      profile_distance(q, slant_normal.dot(q - rim), slant_normal, closest_on_segment(q, rim, apex),
                       rim.y() - q.y(), Vec2(0, -1), closest_on_segment(q, Vec2(0, rim.y()), rim));
  return {distance, from_profile(n, p, q.x())};
}

SurfaceDistance signed_distance(const Plane&, const Vec3& p) {
  return {p.y(), Vec3::UnitY()};
}

SurfaceDistance signed_distance(const CollisionMesh& m, const Vec3& p) {
  Real best2 = kInfinity;
  uint32_t face = 0;
  TrianglePoint nearest;
  m.tree.nearest(p, [&](uint32_t i) {
    const Triangle& t = m.mesh.triangles[i];
    const auto& v = m.mesh.vertices;
    const TrianglePoint q = closest_on_triangle(p, v[t[0]], v[t[1]], v[t[2]]);
    const Real d2 = (p - q.point).squaredNorm();
    if (d2 < best2) {
      best2 = d2;
      face = i;
      nearest = q;
    }
    return d2;
  });
  const Vec3 outward = feature_normal(m, face, nearest.weights), away = p - nearest.point;
  const Vec3 n = direction(away, outward);
  const bool inside = m.solid && outward.dot(away) < 0;
  return inside ? SurfaceDistance{-away.norm(), -n} : SurfaceDistance{away.norm(), n};
}

SurfaceDistance signed_distance(const Solid& s, const Vec3& p) {
  if (s.mesh) return signed_distance(*s.mesh, p);
  return std::visit(
      [&](const auto& shape) -> SurfaceDistance {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, MeshShape>)
          return {};
        else
          return signed_distance(shape, p);
      },
      *s.shape);
}

Real support(const Solid& s, const Vec3& n) {
  if (s.mesh) {
    Real best = -kInfinity;
    for (const Vec3& v : s.mesh->mesh.vertices) best = std::max(best, n.dot(v));
    return best;
  }
  return std::visit(
      [&](const auto& shape) -> Real {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, MeshShape>)
          return 0;
        else
          return support_of(shape, n);
      },
      *s.shape);
}

Aabb local_bounds(const Solid& s) {
  if (s.mesh) return s.mesh->tree.bounds();
  Vec3 low, high;
  for (int i = 0; i < 3; ++i) {
    high[i] = support(s, Vec3::Unit(i));
    low[i] = -support(s, -Vec3::Unit(i));
  }
  return {low, high};
}

Aabb bounds(const Solid& s, const Pose& pose) {
  const Mat3 to_world = pose.orientation.toRotationMatrix();
  if (s.mesh) {
    const Aabb box = local_bounds(s);
    const Vec3 centre = to_world * box.center() + pose.position,
               half = to_world.cwiseAbs() * (box.sizes() / 2);
    return {centre - half, centre + half};
  }
  Vec3 low, high;
  for (int i = 0; i < 3; ++i) {
    const Vec3 axis = to_world.row(i);
    high[i] = pose.position[i] + support(s, axis);
    low[i] = pose.position[i] - support(s, -axis);
  }
  return {low, high};
}

Real reach(const Solid& s) {
  if (s.mesh) return s.mesh->reach;
  if (const auto* c = std::get_if<Capsule>(s.shape)) return c->height / 2 + c->radius;
  if (const auto* ball = std::get_if<Sphere>(s.shape)) return ball->radius;
  const Aabb box = local_bounds(s);
  if (const auto* b = std::get_if<Box>(s.shape)) return b->size.norm() / 2;
  return Vec2(box.max().x(), box.max().y()).norm();
}

}  // namespace offstage::sim
