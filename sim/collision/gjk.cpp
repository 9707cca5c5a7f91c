#include "sim/collision/gjk.h"

#include <cmath>

#include "sim/collision/expanding_polytope.h"

namespace offstage::sim {
namespace {

constexpr int kMaxGjkIterations = 100;
// Accepted gap between the bounds of the distance, in units of the rounding of a point.
constexpr Real kTolerance = 4;
// Cores that are closer than this many roundings of a point have no defined direction between them.
constexpr Real kTouchingRoundings = 64;
// If GJK makes no progress at a distance below this fraction of the size, the expanding polytope algorithm
// computes the result.
constexpr Real kNear = 1e-9;
constexpr Real kGjkLevel = 1 + 1e-14;  // squares with a ratio of at most this differ only by rounding
constexpr Real kAccepted = 1e-12;      // fraction of the size: with a smaller gap a stalled query is accepted

/// Returns the start direction: the normal of the last query, or else the direction from B's centre to A's
/// centre.
Vec3 start_direction(const MinkowskiDifference& m, const GjkCache& cache) {
  return cache.direction.squaredNorm() > 0 ? cache.direction : m.centre();
}

/// Returns the start simplex: the simplex of the last query or, if there is none or the cores have no
/// vertices, the support point along the start direction.
Simplex first_simplex(const MinkowskiDifference& m, const GjkCache& cache) {
  Simplex s;
  if (m.has_vertices() && cache.size > 0) {
    s.size = std::min<std::size_t>(cache.size, cache.from.size());
    for (std::size_t k = 0; k < s.size; ++k) s.points[k] = m.at(cache.from[k]);
    return s;
  }
  s.size = 1;
  s.points[0] = m.lowest(start_direction(m, cache), cache.from[0]);
  return s;
}

void store(const Simplex& s, const Vec3& direction, GjkCache& cache) {
  cache.size = static_cast<uint32_t>(s.size);
  for (std::size_t k = 0; k < s.size; ++k) cache.from[k] = s.points[k].from;
  cache.direction = direction;
}

/// Converts the separation of the cores to the separation of the solids with their radii.
Separation around_cores(const MinkowskiDifference& m, Real distance, const Vec3& normal, const Vec3& on_a) {
  Separation s;
  s.distance = distance - m.radius();
  s.normal = normal;
  s.on_a = on_a - m.radius_a() * normal;
  s.on_b = s.on_a - s.distance * normal;
  return s;
}

Separation overlapping(const MinkowskiDifference& m, Simplex& s, GjkCache& cache, int iterations) {
  const DeepestPoint deepest = deepest_point(m, s, start_direction(m, cache));
  store(s, deepest.normal, cache);
  Separation result = around_cores(m, deepest.distance, deepest.normal, deepest.on_a);
  result.iterations = iterations + deepest.iterations;
  result.converged = deepest.converged;
  return result;
}

/// Whether the nearest point of the simplex with a new corner is better. It is if it is nearer to the origin,
/// or if it is equally near within rounding and lies in a face instead of on an edge, because a face gives a
/// better normal.
bool is_progress(const SimplexPoint& nearer, const SimplexPoint& nearest) {
  return nearer.squared < nearest.squared ||
         (nearer.size > nearest.size && nearer.squared <= kGjkLevel * nearest.squared);
}

// Solids with places are compared in the frames of their cores, so that support points need no
// transformation.

Pose place_of(const Convex& c) {
  return c.place ? *c.place : Pose{};
}

Convex without_place(Convex c) {
  c.place = nullptr;
  return c;
}

/// Returns the pose of B's core in the frame of A's core.
Pose between_cores(const Convex& a, const Convex& b, const Pose& a_from_b) {
  const Pose at_a = place_of(a), at_b = place_of(b);
  return {at_a.point_to_body(a_from_b.point_to_world(at_b.position)),
          at_a.orientation.conjugate() * a_from_b.orientation * at_b.orientation};
}

}  // namespace

Separation gjk(const Convex& a, const Convex& b, const Pose& a_from_b, GjkCache& cache) {
  if (a.place || b.place) {
    const Pose at_a = place_of(a);
    Separation s = gjk(without_place(a), without_place(b), between_cores(a, b, a_from_b), cache);
    s.normal = at_a.vector_to_world(s.normal);
    s.on_a = at_a.point_to_world(s.on_a);
    s.on_b = at_a.point_to_world(s.on_b);
    return s;
  }
  const MinkowskiDifference m(a, b, a_from_b);
  const Real rounding = m.rounding(), size = rounding / std::numeric_limits<Real>::epsilon();
  Simplex s = first_simplex(m, cache);
  SimplexPoint nearest = nearest_point(s);
  reduce(s, nearest);
  int iterations = 0;
  bool converged = false;
  Real distance = 0;
  for (;;) {
    distance = std::sqrt(nearest.squared);
    if (nearest.size == 4 || distance <= kTouchingRoundings * rounding)
      return overlapping(m, s, cache, iterations);
    ++iterations;
    const SupportPoint p = m.lowest(nearest.v, s.points[0].from);
    const Real gap = distance - nearest.v.dot(p.w) / distance;
    converged = gap <= kTolerance * rounding;
    if (converged || iterations == kMaxGjkIterations) break;
    s.points[s.size++] = p;
    const SimplexPoint nearer = nearest_point(s);
    if (!is_progress(nearer, nearest)) {
      --s.size;
      if (distance < kNear * size) return overlapping(m, s, cache, iterations);
      converged = gap <= kAccepted * size;
      break;
    }
    nearest = nearer;
    reduce(s, nearest);
  }
  const Vec3 normal = nearest.v / distance;
  store(s, normal, cache);
  Separation result = around_cores(m, distance, normal, nearest.on_a(s));
  result.iterations = iterations;
  result.converged = converged;
  return result;
}

Separation penetration(const Convex& a, const Convex& b, const Pose& a_from_b) {
  GjkCache cache;
  return gjk(a, b, a_from_b, cache);
}

bool overlap(const Convex& a, const Convex& b, const Pose& a_from_b, GjkCache& cache) {
  if (a.place || b.place)
    return overlap(without_place(a), without_place(b), between_cores(a, b, a_from_b), cache);
  const MinkowskiDifference m(a, b, a_from_b);
  const Real radius2 = m.radius() * m.radius();
  Simplex s;
  SimplexPoint nearest;
  Vec3 d = start_direction(m, cache);
  if (m.has_vertices() && cache.size == 4) {  // the tetrahedron that contained the origin in the last query
    s = first_simplex(m, cache);
    nearest = nearest_point(s);
    if (nearest.size == 4) return true;
    reduce(s, nearest);
    d = nearest.v;
  }
  VertexPair hint = cache.from[0];
  for (int i = 0; i < kMaxGjkIterations; ++i) {
    const SupportPoint p = m.lowest(d, hint);
    hint = p.from;
    if (const Real along = d.dot(p.w); along > 0 && along * along > radius2 * d.squaredNorm()) {
      store({1, {p}}, d.normalized(), cache);
      return false;
    }
    s.points[s.size++] = p;
    const SimplexPoint nearer = nearest_point(s);
    if (!(nearer.squared < nearest.squared)) break;  // they touch within rounding
    nearest = nearer;
    reduce(s, nearest);
    d = nearest.v;
    if (nearest.size == 4 || nearest.squared <= radius2) break;
  }
  store(s, cache.direction, cache);
  return true;
}

}  // namespace offstage::sim
