#include "sim/geometry/intersection.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "sim/geometry/closest_points.h"
#include "sim/geometry/predicates.h"

namespace offstage::sim {
namespace {

using Eigen::Vector2d;

/// The signs of three values, as -1, 0, 1.
using Signs = std::array<int, 3>;

int sign(Real x) {
  return (x > 0) - (x < 0);
}

/// Signs of orient3d(a, p) for the vertices p of b.
Signs sides(const TriangleVertices& a, const TriangleVertices& b) {
  const OrientedPlane plane(a[0], a[1], a[2]);
  return {sign(plane.side(b[0])), sign(plane.side(b[1])), sign(plane.side(b[2]))};
}

bool one_sided(const Signs& s) {
  return s[0] != 0 && s[0] == s[1] && s[0] == s[2];
}

bool all_zero(const Signs& s) {
  return s == Signs{0, 0, 0};
}

Vector2d project(const Vec3& p, int dropped) {
  return {p[(dropped + 1) % 3], p[(dropped + 2) % 3]};
}

Aabb box_of(std::span<const Vec3> points) {
  Aabb box;
  for (const Vec3& p : points) box.extend(p);
  return box;
}

/// Returns whether the line through two points of `a`, in a projection along an axis, has all of `a` on one
/// side or on it, and all of `b` strictly on the other side.
bool edge_separates(std::span<const Vec3> a, std::span<const Vec3> b, int dropped) {
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = i + 1; j < a.size(); ++j) {
      const Vector2d p = project(a[i], dropped), q = project(a[j], dropped);
      const auto side = [&](const Vec3& x) { return sign(orient2d(p, q, project(x, dropped))); };
      const int far = side(b[0]);
      if (far != 0 && std::all_of(b.begin(), b.end(), [&](const Vec3& x) { return side(x) == far; }) &&
          std::all_of(a.begin(), a.end(), [&](const Vec3& x) { return side(x) * far <= 0; }))
        return true;
    }
  return false;
}

/// Returns whether the hulls of up to three points each, all in one plane, intersect. In two dimensions
/// disjoint convex polygons are separated by an edge of one of them, or lie on one line and have disjoint
/// boxes. The test is done in the projections along all coordinate axes: at least one of them does not
/// project the plane to a line, and a separation in any projection is a separation in space.
bool coplanar_intersect(std::span<const Vec3> a, std::span<const Vec3> b) {
  if (!box_of(a).intersects(box_of(b))) return false;
  for (int axis = 0; axis < 3; ++axis)
    if (edge_separates(a, b, axis) || edge_separates(b, a, axis)) return false;
  return true;
}

bool collinear(const TriangleVertices& t) {
  for (int axis = 0; axis < 3; ++axis)
    if (orient2d(project(t[0], axis), project(t[1], axis), project(t[2], axis)) != 0) return false;
  return true;
}

/// Whether two collinear point sets lie on skew lines.
bool skew(std::span<const Vec3> a, std::span<const Vec3> b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      if (orient3d(a[i], a[(i + 1) % a.size()], b[j], b[(j + 1) % b.size()]) != 0) return true;
  return false;
}

bool any_edge_intersects(const TriangleVertices& edges, const TriangleVertices& t) {
  for (std::size_t i = 0; i < 3; ++i)
    if (segment_intersects_triangle(edges[i], edges[(i + 1) % 3], t)) return true;
  return false;
}

/// Returns the vertex that is alone on its side of a plane, and the sign of this side. The others are on the
/// other side or in the plane. If two vertices are on one side and the third is in the plane, the third one
/// is returned, as if it were on the other side.
std::pair<std::size_t, int> lone_vertex(const Signs& s) {
  for (std::size_t i = 0; i < 3; ++i)
    if (s[i] != 0 && s[i] * s[(i + 1) % 3] <= 0 && s[i] * s[(i + 2) % 3] <= 0) return {i, s[i]};
  const auto zero = static_cast<std::size_t>(std::find(s.begin(), s.end(), 0) - s.begin());
  return {zero, -s[(zero + 1) % 3]};
}

}  // namespace

bool point_in_triangle(const Vec3& p, const TriangleVertices& t) {
  return orient3d(t[0], t[1], t[2], p) == 0 && coplanar_intersect({&p, 1}, t);
}

bool segments_intersect(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1) {
  const std::array<Vec3, 2> p = {p0, p1}, q = {q0, q1};
  return orient3d(p0, p1, q0, q1) == 0 && coplanar_intersect(p, q);
}

bool segment_intersects_triangle(const Vec3& p, const Vec3& q, const TriangleVertices& t) {
  const OrientedPlane plane(t[0], t[1], t[2]);
  const int above_p = sign(plane.side(p)), above_q = sign(plane.side(q));
  if (above_p * above_q > 0) return false;
  if (above_p == 0 && above_q == 0) {
    const std::array<Vec3, 2> segment = {p, q};
    return !(collinear(t) && skew(segment, t)) && coplanar_intersect(segment, t);
  }
  // The line crosses the plane. It crosses the triangle if it passes all edges on the same side.
  int low = 0, high = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const int side = sign(orient3d(p, q, t[i], t[(i + 1) % 3]));
    low = std::min(low, side);
    high = std::max(high, side);
  }
  return low * high == 0;
}

bool triangles_intersect(const TriangleVertices& a, const TriangleVertices& b) {
  const Signs side_a = sides(b, a);
  if (one_sided(side_a)) return false;
  const Signs side_b = sides(a, b);
  if (one_sided(side_b)) return false;
  if (all_zero(side_a) && all_zero(side_b))
    return !(collinear(a) && collinear(b) && skew(a, b)) && coplanar_intersect(a, b);
  // A triangle without area has no plane; it is treated as the union of its edges.
  if (all_zero(side_a)) return any_edge_intersects(b, a);
  if (all_zero(side_b)) return any_edge_intersects(a, b);
  // Each triangle cuts the common line of the planes in an interval that ends on the edges at the triangle's
  // lone vertex. The triangles are oriented so that each lone vertex is above the plane of the other; they
  // intersect if each interval begins before the other ends.
  const auto [i, above_b] = lone_vertex(side_a);
  const auto [j, above_a] = lone_vertex(side_b);
  const Vec3 &p1 = a[i], &p2 = b[j];
  const Vec3 *q1 = &a[(i + 1) % 3], *r1 = &a[(i + 2) % 3], *q2 = &b[(j + 1) % 3], *r2 = &b[(j + 2) % 3];
  if (above_b < 0) std::swap(q2, r2);
  if (above_a < 0) std::swap(q1, r1);
  return orient3d(p1, *q1, p2, *q2) <= 0 && orient3d(p1, *r1, *r2, p2) <= 0;
}

bool triangle_intersects_box(const TriangleVertices& t, const Aabb& box) {
  const Vec3 centre = box.center(), half = box.sizes() / 2;
  const TriangleVertices v = {t[0] - centre, t[1] - centre, t[2] - centre};
  const auto separates = [&](const Vec3& axis) {
    const auto [low, high] = std::minmax({axis.dot(v[0]), axis.dot(v[1]), axis.dot(v[2])});
    const Real spread = axis.cwiseAbs().dot(half);
    return low > spread || high < -spread;
  };
  for (int k = 0; k < 3; ++k)
    if (separates(Vec3::Unit(k))) return false;
  if (separates((t[1] - t[0]).cross(t[2] - t[0]))) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 edge = t[(i + 1) % 3] - t[i];
    for (int k = 0; k < 3; ++k)
      if (separates(Vec3::Unit(k).cross(edge))) return false;
  }
  return true;
}

bool triangle_intersects_sphere(const TriangleVertices& t, const Vec3& centre, Real radius) {
  const Vec3 nearest = closest_on_triangle(centre, t[0], t[1], t[2]).point;
  return (nearest - centre).squaredNorm() <= radius * radius;
}

}  // namespace offstage::sim
