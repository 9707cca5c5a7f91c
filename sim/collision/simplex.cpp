#include "sim/collision/simplex.h"

#include <algorithm>

namespace offstage::sim {
namespace {

// An origin that is beyond an edge by less than this fraction of the corners' distance counts as on the edge.
constexpr Real kOnEdge = 1e-15;
constexpr Real kFlatAngle2 = 1e-24;  // squared sine of the angle below which a triangle has no normal
constexpr Real kRounding = 1e-13;    // rounding error of a volume, relative to the product of its edges

/// A point with its index in the simplex.
struct SimplexCorner {
  const Vec3& w;
  uint8_t place;
};

SimplexPoint at_corner(const SimplexCorner& i) {
  return {i.w, i.w.squaredNorm(), 1, {i.place}, {1}};
}

SimplexPoint on_segment(const SimplexCorner& i, const SimplexCorner& j) {
  const Vec3 &p = i.w, e = j.w - p;
  const Real along = -e.dot(p), length2 = e.squaredNorm();
  if (!(along > 0)) return at_corner(i);
  if (!(along < length2)) return at_corner(j);
  const Real t = along / length2;
  Vec3 v = p + t * e;
  v -= e.dot(v) / length2 *
       // This vector is perpendicular to the edge even if it is tiny, because its direction matters as much
       // as its length.
       e;
  return {v, v.squaredNorm(), 2, {i.place, j.place}, {1 - t, t}};
}

void keep_nearer(SimplexPoint& best, const SimplexPoint& p) {
  if (p.squared < best.squared) best = p;
}

// With n normal to the triangle, the barycentric coordinates of the origin's projection are areas seen along
// n. If any coordinate is negative, the nearest point lies on an edge with a negative coordinate.
SimplexPoint on_triangle(const SimplexCorner& i, const SimplexCorner& j, const SimplexCorner& k) {
  const Vec3 &p = i.w, e = j.w - p, f = k.w - p, n = e.cross(f);
  const Real area2 = n.squaredNorm();
  SimplexPoint best;
  if (!(area2 > kFlatAngle2 * e.squaredNorm() * f.squaredNorm())) {
    keep_nearer(best, on_segment(i, j));
    keep_nearer(best, on_segment(i, k));
    keep_nearer(best, on_segment(j, k));
    return best;
  }
  const Vec3 c = p.cross(n);
  const Real at_j = f.dot(c) / area2, at_k = -e.dot(c) / area2, at_i = 1 - at_j - at_k;
  const Real within =
      -kOnEdge * std::sqrt(p.squaredNorm() * std::max(e.squaredNorm(), f.squaredNorm()) / area2);
  if (at_i >= within && at_j >= within && at_k >= within) {
    const Real height = n.dot(p) / area2;
    return {n * height, height * height * area2, 3, {i.place, j.place, k.place}, {at_i, at_j, at_k}};
  }
  if (at_k < 0) keep_nearer(best, on_segment(i, j));
  if (at_j < 0) keep_nearer(best, on_segment(i, k));
  if (at_i < 0) keep_nearer(best, on_segment(j, k));
  return best;
}

// As for a triangle, the nearest point lies in a face with a negative coordinate. The coordinates of a
// tetrahedron that is flat within rounding are meaningless, so all of its faces are tried.
SimplexPoint in_tetrahedron(const SimplexCorner& i, const SimplexCorner& j, const SimplexCorner& k,
                            const SimplexCorner& l) {
  const Vec3 &p = l.w, e = i.w - p, f = j.w - p, g = k.w - p;
  const Vec3 fg = f.cross(g), ge = g.cross(e), ef = e.cross(f);
  const Real volume = e.dot(fg);
  const Real ee = e.squaredNorm(), ff = f.squaredNorm(), gg = g.squaredNorm();
  const Real rounding2 =
      kRounding * kRounding * std::max({ff * gg, gg * ee, ee * ff}) * (p.squaredNorm() + ee);
  const bool flat = !(volume * volume > rounding2);
  const Real at_i = -p.dot(fg) / volume, at_j = -p.dot(ge) / volume, at_k = -p.dot(ef) / volume;
  const Real at_l = 1 - at_i - at_j - at_k;
  if (!flat && at_i >= 0 && at_j >= 0 && at_k >= 0 && at_l >= 0)
    return {Vec3::Zero(), 0, 4, {0, 1, 2, 3}, {at_i, at_j, at_k, at_l}};
  SimplexPoint best;
  if (flat || at_i < 0) keep_nearer(best, on_triangle(j, k, l));
  if (flat || at_j < 0) keep_nearer(best, on_triangle(i, k, l));
  if (flat || at_k < 0) keep_nearer(best, on_triangle(i, j, l));
  if (flat || at_l < 0) keep_nearer(best, on_triangle(i, j, k));
  return best;
}

}  // namespace

Vec3 SimplexPoint::on_a(const Simplex& s) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < size; ++k) sum += weight[k] * s.points[corner[k]].a;
  return sum;
}

SimplexPoint nearest_point(const Simplex& s) {
  const SimplexCorner i{s.points[0].w, 0}, j{s.points[1].w, 1}, k{s.points[2].w, 2}, l{s.points[3].w, 3};
  switch (s.size) {
    case 1:
      return at_corner(i);
    case 2:
      return on_segment(i, j);
    case 3:
      return on_triangle(i, j, k);
    default:
      return in_tetrahedron(i, j, k, l);
  }
}

SimplexPoint nearest_on_triangle(const Vec3& p, const Vec3& q, const Vec3& r) {
  return on_triangle({p, 0}, {q, 1}, {r, 2});
}

void reduce(Simplex& s, SimplexPoint& p) {
  // Indices of corners ascend, so none is overwritten before it is read.
  for (uint8_t k = 0; k < p.size; ++k) {
    if (p.corner[k] != k) s.points[k] = s.points[p.corner[k]];
    p.corner[k] = k;
  }
  s.size = p.size;
}

}  // namespace offstage::sim
