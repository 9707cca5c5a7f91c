#include "sim/geometry/closest_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace offstage::sim {
namespace {

/// The point on an edge of a triangle that is nearest to a given point.
struct EdgePoint {
  TrianglePoint at;
  Real squared_distance;
};

EdgePoint nearest_edge_point(const Vec3& p, const std::array<const Vec3*, 3>& v) {
  EdgePoint best;
  best.squared_distance = std::numeric_limits<Real>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const Real t = closest_on_segment(p, *v[i], *v[j]);
    const Vec3 q = t == 1 ? *v[j] : Vec3(*v[i] + t * (*v[j] - *v[i]));
    const Real d2 = (p - q).squaredNorm();
    if (!(d2 < best.squared_distance)) continue;
    best = {{q, {0, 0, 0}}, d2};
    best.at.weights[i] = 1 - t;
    best.at.weights[j] = t;
  }
  return best;
}

void keep_nearer(ClosestPoints& best, const Vec3& on_a, const Vec3& on_b) {
  const Real d2 = (on_a - on_b).squaredNorm();
  if (d2 < best.squared_distance) best = {on_a, on_b, d2};
}

/// Finds each point where an edge of `edges` crosses the plane of `t`, and calls keep() with it and the point
/// of `t` nearest to it.
template <class Keep>
void for_each_crossing(const TriangleVertices& edges, const TriangleVertices& t, Keep&& keep) {
  const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]);
  std::array<Real, 3> height;
  for (std::size_t i = 0; i < 3; ++i) height[i] = n.dot(edges[i] - t[0]);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    if (!(height[i] * height[j] < 0)) continue;
    const Vec3 p = edges[i] + height[i] / (height[i] - height[j]) * (edges[j] - edges[i]);
    keep(p, closest_on_triangle(p, t[0], t[1], t[2]).point);
  }
}

/// Returns a common point of two intersecting triangles, exact up to rounding. It is a point where an edge
/// pierces the other triangle; if none is found, the closest points of the features are returned.
ClosestPoints shared_point(const TriangleVertices& a, const TriangleVertices& b, ClosestPoints best) {
  for_each_crossing(a, b, [&](const Vec3& p, const Vec3& q) { keep_nearer(best, p, q); });
  for_each_crossing(b, a, [&](const Vec3& p, const Vec3& q) { keep_nearer(best, q, p); });
  const Vec3 middle = (best.on_a + best.on_b) / 2;
  return {middle, middle, 0};
}

}  // namespace

Real closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const Real along = ab.dot(p - a), length2 = ab.squaredNorm();
  if (!(along > 0)) return 0;
  return along < length2 ? along / length2 : 1;
}

// The function tests the Voronoi regions of the triangle, as in Ericson, "Real-Time Collision Detection"
// (2005), 5.1.5, but computes the areas from cross products.
TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const Real d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
             d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return {a, {1, 0, 0}};
  if (d3 >= 0 && d4 <= d3) return {b, {0, 1, 0}};
  if (d6 >= 0 && d5 <= d6) return {c, {0, 0, 1}};
  const Vec3 n = ab.cross(ac);
  const Real va = n.dot((c - b).cross(bp)), vb = n.dot(ap.cross(ac)), vc = n.dot(ab.cross(ap));
  if (!(va > 0 && vb > 0 && vc > 0)) return nearest_edge_point(p, {&a, &b, &c}).at;
  // va + vb + vc equals |n|^2, but is less accurate where b and c are far. If vb + vc is larger, dividing by
  // |n|^2 would put the point outside of the triangle.
  const Real sum = std::max(n.squaredNorm(), vb + vc), v = vb / sum, w = vc / sum;
  return {a + v * ab + w * ac, {1 - v - w, v, w}};
}

// The common perpendicular of the two lines gives the fraction s along p. This s is clamped to the segment.
// Then the nearest t along q is computed and clamped, and then the nearest s again. The squared distance is
// convex, so each step minimises it over one fraction while the other is fixed.
ClosestPoints closest_on_segments(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1) {
  const Vec3 dp = p1 - p0, dq = q1 - q0, n = dp.cross(dq);
  const Real n2 = n.squaredNorm();
  const Real s = n2 > 0 ? std::clamp(n.dot((q0 - p0).cross(dq)) / n2, 0.0, 1.0) : 0.0;
  const Vec3 on_q = q0 + closest_on_segment(p0 + s * dp, q0, q1) * dq;
  const Vec3 on_p = p0 + closest_on_segment(on_q, p0, p1) * dp;
  return {on_p, on_q, (on_p - on_q).squaredNorm()};
}

ClosestPoints closest_segment_plane(const Vec3& p, const Vec3& q, const Vec3& n, Real offset) {
  const Real above_p = n.dot(p) - offset, above_q = n.dot(q) - offset;
  if (above_p * above_q < 0) {
    const Vec3 crossing = p + above_p / (above_p - above_q) * (q - p);
    return {crossing, crossing, 0};
  }
  const bool first = std::abs(above_p) <= std::abs(above_q);
  const Vec3& nearest = first ? p : q;
  const Real height = first ? above_p : above_q;
  return {nearest, nearest - height * n, height * height};
}

ClosestPoints closest_on_triangles(const TriangleVertices& a, const TriangleVertices& b) {
  ClosestPoints best = {a[0], b[0], (a[0] - b[0]).squaredNorm()};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const ClosestPoints c = closest_on_segments(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]);
      if (c.squared_distance < best.squared_distance) best = c;
    }
  for (const Vec3& p : a) keep_nearer(best, p, closest_on_triangle(p, b[0], b[1], b[2]).point);
  for (const Vec3& p : b) keep_nearer(best, closest_on_triangle(p, a[0], a[1], a[2]).point, p);
  return triangles_intersect(a, b) ? shared_point(a, b, best) : best;
}

}  // namespace offstage::sim
