#include "sim/collision/distance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

using Vec2 = Eigen::Vector2d;

/// Returns v / |v|, or `fallback` if v is zero.
Vec3 direction(const Vec3& v, const Vec3& fallback) {
  const Real norm = v.norm();
  return norm > 0 ? Vec3(v / norm) : fallback;
}

/// Returns a point's distance from the Y axis and its height, as coordinates in the half plane of a solid of
/// revolution about Y.
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

/// Returns the distance to two faces that bound a convex profile. Inside it is the distance from the line of
/// the nearer face, outside from the nearer of the two closest points.
ProfileDistance profile_distance(const Vec2& p, Real above_1, const Vec2& normal_1, const Vec2& closest_1,
                                 Real above_2, const Vec2& normal_2, const Vec2& closest_2) {
  if (above_1 <= 0 && above_2 <= 0)
    return above_1 > above_2 ? ProfileDistance{above_1, normal_1} : ProfileDistance{above_2, normal_2};
  const bool first = (p - closest_1).squaredNorm() < (p - closest_2).squaredNorm();
  const Vec2 away = p - (first ? closest_1 : closest_2);
  const Real distance = away.norm();
  return {distance, distance > 0 ? Vec2(away / distance) : (first ? normal_1 : normal_2)};
}

/// Returns the pseudonormal of the feature of a face that contains the point with these barycentric weights.
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
Real support_of(const Frustum& c, const Vec3& n) {
  const Real out = to_profile(n).x();
  return std::max(n.y() * c.height / 2 + c.top_radius * out, c.radius * out - n.y() * c.height / 2);
}
Real support_of(const Ellipsoid& e, const Vec3& n) {
  return e.radii.cwiseProduct(n).norm();
}
Real support_of(const Plane&, const Vec3& n) {
  return n.x() == 0 && n.z() == 0 && n.y() >= 0 ? 0 : kInfinity;
}

}  // namespace

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

SurfaceDistance signed_distance(const Frustum& c, const Vec3& p) {
  const Vec2 q = to_profile(p);
  const Real half = c.height / 2;
  const Vec2 base(c.radius, -half), top(c.top_radius, half);
  const Vec2 slant_normal = Vec2(c.height, c.radius - c.top_radius).normalized();
  const bool upper = q.y() > 0;
  const Vec2 rim = upper ? top : base, centre(0, rim.y());
  auto [distance, n] =
      profile_distance(q, slant_normal.dot(q - base), slant_normal, closest_on_segment(q, base, top),
                       std::abs(q.y()) - half, Vec2(0, upper ? 1 : -1), closest_on_segment(q, centre, rim));
  return {distance, from_profile(n, p, q.x())};
}

namespace {

/// Returns the parameter t that determines the point of an ellipsoid nearest to p: y_i = r_i^2 p_i / (t +
/// r_i^2). It is the root of F(t) = sum (r_i p_i / (t + r_i^2))^2 - 1 beyond the pole of the smallest radius
/// (Eberly, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid", 2013). There F
/// decreases and is convex, so Newton's iteration from below the root never passes it.
Real nearest_parameter(const Vec3& r, const Vec3& p, Real least) {
  constexpr int kMostSteps = 100;
  Real t = least;
  for (int step = 0; step < kMostSteps; ++step) {
    Real value = -1, slope = 0;
    for (int i = 0; i < 3; ++i) {
      const Real below = t + r[i] * r[i];
      if (p[i] == 0 || !(below > 0)) continue;
      const Real term = r[i] * p[i] / below;
      value += term * term;
      slope -= 2 * term * term / below;
    }
    if (!(value > 0) || !(slope < 0)) break;
    const Real next = t - value / slope;
    if (!(next > t)) break;
    t = next;
  }
  return t;
}

}  // namespace

SurfaceDistance signed_distance(const Ellipsoid& e, const Vec3& point) {
  const Vec3& r = e.radii;
  const Vec3 p = point.cwiseAbs();
  int thin = 0;
  const Real least_radius = r.minCoeff(&thin);
  // This start is below the root: F >= 0 where the term of the thinnest axis alone is 1.
  const Real pole = -least_radius * least_radius;
  Vec3 nearest;
  bool on_axis_plane = false;
  if (!(p[thin] > 0)) {
    // The nearest points of a point in the plane across the thinnest axis may be off this plane.
    Real others = 0;
    for (int i = 0; i < 3; ++i)
      if (i != thin && p[i] > 0) {
        const Real below = pole + r[i] * r[i];
        others += below > 0 ? std::pow(r[i] * p[i] / below, 2) : kInfinity;
      }
    if (others < 1) {
      on_axis_plane = true;
      for (int i = 0; i < 3; ++i)
        nearest[i] = i == thin || p[i] == 0 ? 0 : r[i] * r[i] * p[i] / (pole + r[i] * r[i]);
      nearest[thin] = least_radius * std::sqrt(1 - others);
    }
  }
  if (!on_axis_plane) {
    // Each single term gives a lower bound of the root; the greatest bound is the best start.
    Real start = pole;
    for (int i = 0; i < 3; ++i) start = std::max(start, r[i] * p[i] - r[i] * r[i]);
    const Real t = nearest_parameter(r, p, start);
    for (int i = 0; i < 3; ++i) nearest[i] = p[i] == 0 ? 0 : r[i] * r[i] * p[i] / (t + r[i] * r[i]);
  }
  Vec3 normal = nearest.cwiseQuotient(r.cwiseAbs2());
  for (int i = 0; i < 3; ++i)
    if (point[i] < 0) normal[i] = -normal[i], nearest[i] = -nearest[i];
  const bool inside = p.cwiseQuotient(r).squaredNorm() < 1;
  const Real distance = (point - nearest).norm();
  return {inside ? -distance : distance, direction(normal, Vec3::UnitY())};
}

SurfaceDistance signed_distance(const Plane&, const Vec3& p) {
  return {p.y(), Vec3::UnitY()};
}

namespace {

/// Returns the distance to the nearest triangle, if a triangle is nearer than the square root of `limit2`
/// [m^2].
SurfaceDistance mesh_distance(const CollisionMesh& m, const Vec3& p, Real limit2) {
  Real best2 = limit2;
  uint32_t face = 0;
  TrianglePoint nearest;
  m.tree.nearest(
      p,
      [&](uint32_t i) {
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
      },
      limit2);
  if (best2 == limit2) return {};
  const Vec3 outward = feature_normal(m, face, nearest.weights), away = p - nearest.point;
  const Vec3 n = direction(away, outward);
  const bool inside = m.solid && outward.dot(away) < 0;
  return inside ? SurfaceDistance{-away.norm(), -n} : SurfaceDistance{away.norm(), n};
}

}  // namespace

SurfaceDistance signed_distance(const CollisionMesh& m, const Vec3& p) {
  if (m.solids.empty()) return mesh_distance(m, p, kInfinity);
  // The distance to a union is the smallest distance to one of its solids. Outside it is exact; inside, the
  // surface is at least this far away.
  SurfaceDistance nearest;
  for (const auto& solid : m.solids)
    if (const SurfaceDistance d = mesh_distance(*solid, p, kInfinity); d.distance < nearest.distance)
      nearest = d;
  return nearest;
}

SurfaceDistance signed_distance_below(const Solid& s, const Vec3& p, Real limit) {
  // A point that may be inside can be deep inside, so the limit does not apply to it.
  const bool outside = s.mesh && (!s.mesh->solid || s.mesh->clearance_grid().is_outside(p));
  return outside ? mesh_distance(*s.mesh, p, limit * limit) : signed_distance(s, p);
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
  if (s.mesh) return n.dot(s.mesh->hull.vertex(support_vertex(s.mesh->hull, n, 0)));
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
  if (const auto* ball = std::get_if<Sphere>(s.shape)) {
    const Vec3 half = Vec3::Constant(ball->radius);
    return {pose.position - half, pose.position + half};
  }
  const Mat3 to_world = pose.orientation.toRotationMatrix();
  if (const auto* box = std::get_if<Box>(s.shape)) {
    const Vec3 half = to_world.cwiseAbs() * box->size / 2;
    return {pose.position - half, pose.position + half};
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
  if (s.mesh) return s.mesh->hull.reach();
  if (const auto* c = std::get_if<Capsule>(s.shape)) return c->height / 2 + c->radius;
  if (const auto* ball = std::get_if<Sphere>(s.shape)) return ball->radius;
  if (const auto* e = std::get_if<Ellipsoid>(s.shape)) return e->radii.maxCoeff();
  const Aabb box = local_bounds(s);
  if (const auto* b = std::get_if<Box>(s.shape)) return b->size.norm() / 2;
  return Vec2(box.max().x(), box.max().y()).norm();
}

}  // namespace offstage::sim
