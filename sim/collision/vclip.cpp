#include "sim/collision/vclip.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sim/collision/gjk.h"
#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

using Kind = Feature::Kind;
constexpr uint32_t kNone = 0xffffffff;

/// Rounding error of a computed height over a plane, as a fraction of the coordinates' size. The walk leaves
/// a feature only for a neighbour that is better by more than this, so that rounding seldom makes it go in
/// circles.
constexpr Real kVClipRounding = 1e-14;
/// If two points are closer than this fraction of the coordinates' size, their difference does not define a
/// normal.
constexpr Real kVClipTouching = 1e-12;

enum class Step : uint8_t { moved, closest, overlapping };

/// One of the two polyhedra, with its transformation to the other's frame and its current feature.
struct Side {
  const ConvexPolyhedron& shape;
  Mat3 rotation;
  Vec3 translation;
  Feature at;
  Real slop;  ///< rounding error of heights over planes [m]

  Vec3 to_other(const Vec3& p) const { return rotation * p + translation; }
  const Vec3& vertex() const { return shape.vertex(at.index); }
  const ConvexPolyhedron::Edge& edge() const { return shape.edge(at.index); }
  const Vec3& tail() const { return shape.vertex(edge().tail); }
  const Vec3& head() const { return shape.vertex(edge().head); }
  bool move(Kind kind, uint32_t index) {
    at = {kind, index};
    return true;
  }
};

/// The part of a segment that is inside all clipping planes so far, and the features beyond the planes that
/// cut its ends. The part is given by parameters from the tail (0) to the head (1).
struct Clip {
  Real low = 0, high = 1;
  uint32_t beyond_low = kNone, beyond_high = kNone;

  /// Cuts the segment at a plane. `tail` and `head`: heights of both ends over it, positive inside. Returns
  /// false if nothing is left.
  bool cut(Real tail, Real head, uint32_t beyond) {
    if (tail < 0 && head < 0) return false;
    if (tail >= 0 && head >= 0) return true;
    const Real at = tail / (tail - head);
    if (tail < 0 && at > low) {
      low = at;
      beyond_low = beyond;
    } else if (head < 0 && at < high) {
      high = at;
      beyond_high = beyond;
    }
    return true;
  }
  bool empty() const { return low > high; }
};

/// Moves from a vertex to the edge whose vertex-edge plane p violates most. Returns false if p violates none.
bool leave_vertex(Side& x, const Vec3& p) {
  const Vec3 d = p - x.vertex();
  Real worst = x.slop;
  uint32_t to = kNone;
  for (uint32_t e : x.shape.vertex_edges(x.at.index)) {
    const Real along = x.shape.edge_frame(e).along.dot(d);
    const Real beyond = x.shape.edge(e).tail == x.at.index ? along : -along;
    if (beyond <= worst) continue;
    worst = beyond;
    to = e;
  }
  return to != kNone && x.move(Kind::edge, to);
}

/// Moves from an edge to the end or the face in whose direction p lies.
bool leave_edge(Side& x, const Vec3& p) {
  const ConvexPolyhedron::EdgeFrame& frame = x.shape.edge_frame(x.at.index);
  const Vec3 d = p - x.tail();
  if (frame.along.dot(d) < -x.slop) return x.move(Kind::vertex, x.edge().tail);
  if (frame.along.dot(p - x.head()) > x.slop) return x.move(Kind::vertex, x.edge().head);
  const Real left = frame.into_left.dot(d), right = frame.into_right.dot(d);
  if (std::max(left, right) <= x.slop) return false;
  return x.move(Kind::face, left >= right ? x.edge().left : x.edge().right);
}

/// Moves from an edge x towards an edge of the other polyhedron. That edge is clipped to the Voronoi region
/// of x, first by the vertex-edge planes and then by the face-edge planes. If the distance increases inwards
/// from a cut, the closest point lies beyond the cut. On a cut, the distances from x and from the neighbour
/// beyond are equal, and so are their derivatives; the neighbour's is simpler to compute.
bool leave_edge(Side& x, const Vec3& tail, const Vec3& head) {
  const ConvexPolyhedron::Edge& edge = x.edge();
  const ConvexPolyhedron::EdgeFrame& frame = x.shape.edge_frame(x.at.index);
  const Vec3 along = head - tail;
  const auto at = [&](Real lambda) -> Vec3 { return tail + lambda * along; };

  Clip clip;
  if (!clip.cut(frame.along.dot(tail - x.tail()), frame.along.dot(head - x.tail()), edge.tail))
    return x.move(Kind::vertex, edge.tail);
  if (!clip.cut(frame.along.dot(x.head() - tail), frame.along.dot(x.head() - head), edge.head))
    return x.move(Kind::vertex, edge.head);
  if (clip.beyond_low != kNone && along.dot(at(clip.low) - x.shape.vertex(clip.beyond_low)) > 0)
    return x.move(Kind::vertex, clip.beyond_low);
  if (clip.beyond_high != kNone && along.dot(at(clip.high) - x.shape.vertex(clip.beyond_high)) < 0)
    return x.move(Kind::vertex, clip.beyond_high);
  if (edge.left == kNoFace) return false;

  clip.beyond_low = clip.beyond_high = kNone;
  if (!clip.cut(-frame.into_left.dot(tail - x.tail()), -frame.into_left.dot(head - x.tail()), edge.left))
    return x.move(Kind::face, edge.left);
  if (!clip.cut(-frame.into_right.dot(tail - x.tail()), -frame.into_right.dot(head - x.tail()), edge.right))
    return x.move(Kind::face, edge.right);
  const auto growth = [&](uint32_t face, Real lambda) {
    const ConvexPolyhedron::Plane& plane = x.shape.plane(face);
    const Real slope = plane.normal.dot(along);
    return plane.normal.dot(at(lambda)) < plane.offset ? -slope : slope;
  };
  if (clip.beyond_low != kNone &&
      ((clip.empty() && clip.beyond_high == kNone) || growth(clip.beyond_low, clip.low) > x.slop))
    return x.move(Kind::face, clip.beyond_low);
  if (clip.beyond_high != kNone && (clip.empty() || growth(clip.beyond_high, clip.high) < -x.slop))
    return x.move(Kind::face, clip.beyond_high);
  return false;
}

Step vertex_vertex(Side& x, Side& y) {
  return leave_vertex(x, y.to_other(y.vertex())) || leave_vertex(y, x.to_other(x.vertex())) ? Step::moved
                                                                                            : Step::closest;
}

Step vertex_edge(Side& v, Side& e) {
  const Vec3 p = v.to_other(v.vertex());
  if (leave_edge(e, p)) return Step::moved;
  const Vec3& along = e.shape.edge_frame(e.at.index).along;
  const Vec3 closest = e.tail() + along.dot(p - e.tail()) * along;
  return leave_vertex(v, e.to_other(closest)) ? Step::moved : Step::closest;
}

Step edge_edge(Side& x, Side& y) {
  return leave_edge(x, y.to_other(y.tail()), y.to_other(y.head())) ||
                 leave_edge(y, x.to_other(x.tail()), x.to_other(x.head()))
             ? Step::moved
             : Step::closest;
}

/// Handles a vertex under a face from which no edge leads out of the half-space below. Either the vertex is
/// inside, or another face is closer: the face over which the vertex is highest.
Step escape_local_minimum(Side& f, const Vec3& p) {
  Real best = 0;
  for (uint32_t k = 0; k < f.shape.face_count(); ++k) {
    const ConvexPolyhedron::Plane& plane = f.shape.plane(k);
    const Real height = plane.normal.dot(p) - plane.offset;
    if (height <= best) continue;
    best = height;
    f.at.index = k;
  }
  return best > 0 ? Step::moved : Step::overlapping;
}

Step vertex_face(Side& v, Side& f) {
  const Vec3 p = v.to_other(v.vertex());
  Real worst = -f.slop;
  uint32_t to = kNone;
  for (uint32_t e : f.shape.face_edges(f.at.index)) {
    const ConvexPolyhedron::Edge& edge = f.shape.edge(e);
    const ConvexPolyhedron::EdgeFrame& frame = f.shape.edge_frame(e);
    const Vec3& inward = edge.left == f.at.index ? frame.into_left : frame.into_right;
    const Real inside = inward.dot(p - f.shape.vertex(edge.tail));
    if (inside >= worst) continue;
    worst = inside;
    to = e;
  }
  if (to != kNone && f.move(Kind::edge, to)) return Step::moved;

  const ConvexPolyhedron::Plane& plane = f.shape.plane(f.at.index);
  const Real height = plane.normal.dot(p) - plane.offset;
  const Vec3 away = v.rotation.transpose() * (height > 0 ? plane.normal : Vec3(-plane.normal));
  const std::span<const uint32_t> neighbours = v.shape.vertex_neighbours(v.at.index);
  worst = -v.slop;
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    const Real rise = away.dot(v.shape.vertex(neighbours[k]) - v.vertex());
    if (rise >= worst) continue;
    worst = rise;
    to = v.shape.vertex_edges(v.at.index)[k];
  }
  if (to != kNone && v.move(Kind::edge, to)) return Step::moved;
  return height > 0 ? Step::closest : escape_local_minimum(f, p);
}

/// Returns the side of a face that is closest to a segment.
uint32_t closest_side(const Side& f, const Vec3& tail, const Vec3& head) {
  Real best = std::numeric_limits<Real>::infinity();
  uint32_t closest = kNone;
  for (uint32_t e : f.shape.face_edges(f.at.index)) {
    const Vec3 &p = f.shape.vertex(f.shape.edge(e).tail), &q = f.shape.vertex(f.shape.edge(e).head);
    const Real distance2 = closest_on_segments(p, q, tail, head).squared_distance;
    if (!(distance2 < best)) continue;
    best = distance2;
    closest = e;
  }
  return closest;
}

/// Moves on from an edge and a face, which are never the result: the lower end of the edge's part over the
/// face is closer, or equally close and a simpler feature.
Step edge_face(Side& e, Side& f) {
  const Vec3 tail = e.to_other(e.tail()), head = e.to_other(e.head());
  Clip clip;
  for (uint32_t k : f.shape.face_edges(f.at.index)) {
    const ConvexPolyhedron::EdgeFrame& frame = f.shape.edge_frame(k);
    const Vec3& inward = f.shape.edge(k).left == f.at.index ? frame.into_left : frame.into_right;
    const Vec3& corner = f.shape.vertex(f.shape.edge(k).tail);
    if (clip.cut(inward.dot(tail - corner), inward.dot(head - corner), k) && !clip.empty()) continue;
    f.move(Kind::edge, closest_side(f, tail, head));
    return Step::moved;
  }
  const ConvexPolyhedron::Plane& plane = f.shape.plane(f.at.index);
  const Real low = plane.normal.dot(tail + clip.low * (head - tail)) - plane.offset,
             high = plane.normal.dot(tail + clip.high * (head - tail)) - plane.offset;
  if (low * high <= 0) return Step::overlapping;
  const bool towards_tail = std::abs(low) <= std::abs(high);
  const uint32_t side = towards_tail ? clip.beyond_low : clip.beyond_high;
  if (side != kNone)
    f.move(Kind::edge, side);
  else
    e.move(Kind::vertex, towards_tail ? e.edge().tail : e.edge().head);
  return Step::moved;
}

Step step(Side& a, Side& b) {
  if (a.at.kind > b.at.kind) return step(b, a);
  if (a.at.kind == Kind::vertex) {
    if (b.at.kind == Kind::vertex) return vertex_vertex(a, b);
    return b.at.kind == Kind::edge ? vertex_edge(a, b) : vertex_face(a, b);
  }
  if (b.at.kind == Kind::edge) return edge_edge(a, b);
  if (a.at.kind == Kind::edge) return edge_face(a, b);
  a.move(Kind::vertex, a.shape.face_vertices(a.at.index)[0]);
  return Step::moved;
}

/// Walks from feature to feature until the two are the closest or overlap. Returns nothing if the walk goes
/// in circles. A pair of features determines the next pair, so the walk is in a cycle if a pair occurs twice.
/// The pair for comparison is replaced after 1, 2, 4 ... steps, and so lies on the cycle eventually (Brent,
/// "An improved Monte Carlo factorization algorithm", 1980).
std::optional<Step> walk(Side& a, Side& b, int& steps) {
  Feature kept_a = a.at, kept_b = b.at;
  for (int renewal = 1;;) {
    const Step result = step(a, b);
    ++steps;
    if (result != Step::moved) return result;
    if (a.at == kept_a && b.at == kept_b) return std::nullopt;
    if (steps < renewal) continue;
    renewal *= 2;
    kept_a = a.at;
    kept_b = b.at;
  }
}

/// Returns the closest points of the features of x and y, in y's frame and with y as A. The dimension of x's
/// feature must not be higher.
Separation closest_points(const Side& x, const Side& y) {
  Separation s;
  if (x.at.kind == Kind::edge) {
    const ClosestPoints points =
        closest_on_segments(y.tail(), y.head(), x.to_other(x.tail()), x.to_other(x.head()));
    s.on_a = points.on_a;
    s.on_b = points.on_b;
  } else {
    const Vec3 p = x.to_other(x.vertex());
    s.on_a = s.on_b = p;
    if (y.at.kind == Kind::face) {
      const ConvexPolyhedron::Plane& plane = y.shape.plane(y.at.index);
      s.normal = -plane.normal;
      s.distance = plane.normal.dot(p) - plane.offset;
      s.on_a -= s.distance * plane.normal;
      return s;
    }
    const Vec3& along = y.at.kind == Kind::edge ? y.shape.edge_frame(y.at.index).along : s.normal;
    s.on_a = y.at.kind == Kind::edge ? Vec3(y.tail() + along.dot(p - y.tail()) * along) : y.vertex();
  }
  const Vec3 d = s.on_a - s.on_b;
  s.distance = d.norm();
  if (s.distance > 0) s.normal = d / s.distance;
  return s;
}

/// Exchanges A and B in a separation, and transforms it to the frame of the new A.
Separation exchanged(const Separation& s, const Side& b) {
  return {.distance = s.distance,
          .normal = b.rotation * -s.normal,
          .on_a = b.to_other(s.on_b),
          .on_b = b.to_other(s.on_a)};
}

}  // namespace

Separation vclip(const ConvexPolyhedron& a, const ConvexPolyhedron& b, const Pose& a_from_b,
                 VclipCache& cache) {
  const Mat3 rotation = a_from_b.orientation.toRotationMatrix();
  const Real scale = a.reach() + b.reach() + a_from_b.position.cwiseAbs().maxCoeff(),
             slop = kVClipRounding * scale;
  Side at_a{a, rotation.transpose(), -(rotation.transpose() * a_from_b.position), cache.a, slop};
  Side at_b{b, rotation, a_from_b.position, cache.b, slop};

  int steps = 0;
  const std::optional<Step> result = walk(at_a, at_b, steps);
  cache = {at_a.at, at_b.at};
  Separation s;
  if (!result) {
    GjkCache fresh;
    s = gjk(convex(a), convex(b), a_from_b, fresh);
  } else {
    if (*result == Step::closest)
      s = at_b.at.kind <= at_a.at.kind ? closest_points(at_b, at_a)
                                       : exchanged(closest_points(at_a, at_b), at_b);
    if (*result == Step::overlapping || s.distance <= kVClipTouching * scale)
      s = penetration(convex(a), convex(b), a_from_b);
  }
  s.iterations += steps;
  return s;
}

}  // namespace offstage::sim
