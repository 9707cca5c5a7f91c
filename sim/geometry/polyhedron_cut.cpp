#include "sim/geometry/polyhedron_cut.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <span>
#include <utility>

#include "sim/geometry/polygon.h"

namespace offstage::sim {
namespace {

using CutPlane = Polyhedron::Plane;

constexpr uint32_t kNoVertex = 0xffffffff;
/// Angles below this count as a full turn, and angles that differ by less count as equal [rad].
constexpr Real kNoTurn = 1e-7;

/// Inserts a point in an edge. The half-edge keeps its origin; the half-edge after it starts at the point.
void split_edge(Polyhedron& p, uint32_t h, const Vec3& point) {
  const uint32_t t = p.half_edges[h].twin;
  const auto h2 = static_cast<uint32_t>(p.half_edges.size()), t2 = h2 + 1;
  const auto middle = static_cast<uint32_t>(p.points.size());
  p.points.push_back(point);
  for (const auto& [first, second, twin] : {std::tuple{h, h2, t}, std::tuple{t, t2, h}}) {
    const Polyhedron::HalfEdge& e = p.half_edges[first];
    const uint32_t next = e.next;
    p.half_edges.push_back({middle, e.face, next, first, twin});
    p.half_edges[next].previous = second;
    p.half_edges[first].next = second;
  }
  p.half_edges[h].twin = t2;
  p.half_edges[t].twin = h2;
}

/// Divides a face between the origins of two of its half-edges. Returns the half-edge from the first origin
/// to the second, which has a new face on its left.
uint32_t split_face(Polyhedron& p, uint32_t from, uint32_t to) {
  const uint32_t old_face = p.half_edges[from].face;
  const auto new_face = static_cast<uint32_t>(p.faces.size());
  const auto there = static_cast<uint32_t>(p.half_edges.size()), back = there + 1;
  const uint32_t before_from = p.half_edges[from].previous, before_to = p.half_edges[to].previous;
  p.half_edges.push_back({p.origin(from), new_face, to, before_from, back});
  p.half_edges.push_back({p.origin(to), old_face, from, before_to, there});
  p.half_edges[before_from].next = p.half_edges[to].previous = there;
  p.half_edges[before_to].next = p.half_edges[from].previous = back;
  p.faces[old_face].first = back;
  p.faces.push_back({there, p.faces[old_face].plane});
  p.for_each_around(new_face, [&](uint32_t h) { p.half_edges[h].face = new_face; });
  return there;
}

/// Closes one side of a cut with a cap. outline[k] leads from corner k to corner k + 1 on a cap that is on
/// its right; on the other cap (`mirrored`) it leads back.
void add_cap(Polyhedron& p, std::span<const std::vector<uint32_t>> pieces, std::span<const uint32_t> origins,
             std::span<const uint32_t> outline, const CutPlane& plane, bool mirrored) {
  const auto n = static_cast<uint32_t>(outline.size());
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> diagonals;
  for (std::vector<uint32_t> piece : pieces) {
    if (mirrored) std::reverse(piece.begin(), piece.end());
    const auto first = static_cast<uint32_t>(p.half_edges.size());
    const auto count = static_cast<uint32_t>(piece.size());
    const auto face = static_cast<uint32_t>(p.faces.size());
    p.faces.push_back({first, plane});
    for (uint32_t k = 0; k < count; ++k) {
      const uint32_t a = piece[k], b = piece[(k + 1) % count], h = first + k;
      p.half_edges.push_back(
          {origins[a], face, first + (k + 1) % count, first + (k + count - 1) % count, kNoVertex});
      const uint32_t side = mirrored ? b : a;
      uint32_t twin = kNoVertex;
      if ((side + 1) % n == (mirrored ? a : b)) {
        twin = outline[side];
      } else if (const auto met = diagonals.find({b, a}); met != diagonals.end()) {
        twin = met->second;
      } else {
        diagonals[{a, b}] = h;
      }
      if (twin == kNoVertex) continue;
      p.half_edges[h].twin = twin;
      p.half_edges[twin].twin = h;
    }
  }
}

/// Traces the outline of a cut face.
class Tracer {
 public:
  Tracer(const Polyhedron& p, const CutPlane& plane, Real tolerance)
      : p_(p),
        plane_(plane),
        tolerance_(tolerance),
        height_(p.points.size()),
        seen_point_(p.points.size(), false),
        seen_edge_(p.half_edges.size(), false),
        seen_face_(p.faces.size(), false) {
    for (std::size_t v = 0; v < height_.size(); ++v) {
      const Real h = plane.normal.dot(p.points[v]) - plane.offset;
      height_[v] = std::abs(h) <= tolerance ? 0 : h;
    }
    x_axis_ = plane.normal.unitOrthogonal();
    y_axis_ = plane.normal.cross(x_axis_);
  }

  std::optional<Cut> trace(uint32_t start) {
    height_[p_.origin(start)] = height_[p_.head(start)] = 0;
    origin_ = p_.origin_point(start);
    Cut cut{plane_, {{origin_, start, false, false}}, {}};
    Corner at = {p_.head_point(start), p_.half_edges[start].next, false, false};
    pass(seen_edge_, edge(start));
    seen_point_[p_.origin(start)] = true;
    // The loop ends, because every step crosses a new face or takes a new edge.
    for (;;) {
      const Corner last = cut.corners.back();
      if (at.on_edge) {
        if (!pass(seen_edge_, edge(at.half_edge))) return {};
      } else {
        seen_point_[p_.origin(at.half_edge)] = true;
        if (!turn(at, last.point, last.across_face ? kNoVertex : p_.half_edges[last.half_edge].twin))
          return {};
        if (at.half_edge == start) return closed(std::move(cut));
        if (!at.across_face && !pass(seen_edge_, edge(at.half_edge))) return {};
      }
      if (at.across_face && !pass(seen_face_, p_.half_edges[at.half_edge].face)) return {};
      cut.corners.push_back(at);
      at = at.across_face
               ? far_side(at.half_edge)
               : Corner{p_.head_point(at.half_edge), p_.half_edges[at.half_edge].next, false, false};
    }
  }

 private:
  using Corner = Cut::Corner;

  Real height_at_origin(uint32_t h) const { return height_[p_.origin(h)]; }
  Real height_at_head(uint32_t h) const { return height_[p_.head(h)]; }
  Vec2 flat(const Vec3& d) const { return {x_axis_.dot(d), y_axis_.dot(d)}; }

  /// Returns the number of an edge, which is the same for both of its half-edges.
  uint32_t edge(uint32_t h) const { return std::min(h, p_.half_edges[h].twin); }

  /// Marks element i as visited; returns false if it was visited before.
  static bool pass(std::vector<bool>& seen, uint32_t i) {
    if (seen[i]) return false;
    seen[i] = true;
    return true;
  }

  /// Returns the intersection of the plane with an edge. It is exactly the same point for both half-edges.
  Vec3 crossing(uint32_t h) const {
    uint32_t a = p_.origin(h), b = p_.head(h);
    if (a > b) std::swap(a, b);
    return p_.points[a] + height_[a] / (height_[a] - height_[b]) * (p_.points[b] - p_.points[a]);
  }

  /// Returns the point where the plane leaves a face. It enters the face at the origin or inside a half-edge
  /// whose head is below the plane. Faces are convex, so it leaves the face where the face's outline comes up
  /// to the plane again.
  Corner far_side(uint32_t h) const {
    uint32_t k = p_.half_edges[h].next;
    while (height_at_head(k) < 0) k = p_.half_edges[k].next;
    if (height_at_head(k) > 0) return {crossing(k), p_.half_edges[k].twin, true, true};
    return {p_.head_point(k), p_.half_edges[k].next, false, false};
  }

  /// Chooses the next side from a vertex: the side with the smallest angle inside the cut face (F.2). If a
  /// solid touches itself at a point, its surface has several corners at this point, so the other corners are
  /// considered, too. They must be better by a margin; this excludes the other side of an earlier cut.
  /// Returns false if there is no next side.
  bool turn(Corner& at, const Vec3& from, uint32_t edge_back) const {
    const Vec2 back = flat(from - at.point);
    const uint32_t here = at.half_edge;
    Real least = std::numeric_limits<Real>::infinity();
    const auto consider = [&](const Vec3& to, uint32_t h, bool across_face, Real margin) {
      const Vec2 d = flat(to - at.point);
      Real angle = std::atan2(back.y() * d.x() - back.x() * d.y(), back.dot(d));
      if (angle < kNoTurn) angle += 2 * std::numbers::pi;
      if (angle >= least - margin) return;
      least = angle;
      at = {at.point, h, false, across_face};
    };
    const auto consider_leaving = [&](uint32_t h, Real margin) {
      if (height_at_head(h) == 0 && h != edge_back) consider(p_.head_point(h), h, false, margin);
      if (height_at_head(h) < 0 && height_at_origin(p_.half_edges[h].previous) > 0)
        consider(far_side(h).point, h, true, margin);
    };
    p_.for_each_leaving(here, [&](uint32_t h) { consider_leaving(h, 0); });
    for (uint32_t h = p_.half_edges[here].sibling; h != here; h = p_.half_edges[h].sibling)
      consider_leaving(h, kNoTurn);
    return std::isfinite(least);
  }

  /// Returns the cut with its pieces, or nothing if a part of the surface is inside its outline.
  std::optional<Cut> closed(Cut cut) const {
    std::vector<Vec2> outline;
    for (const Corner& c : cut.corners) outline.push_back(flat(c.point - origin_));
    const auto hit = [&](const Vec3& point) {
      return well_inside(outline, flat(point - origin_), tolerance_);
    };
    if (outline.size() < 3 || !(area(outline) > 0)) return {};
    for (uint32_t v = 0; v < height_.size(); ++v)
      if (height_[v] == 0 && !seen_point_[v] && hit(p_.points[v])) return {};
    for (uint32_t h = 0; h < p_.half_edges.size(); ++h)
      if (height_at_origin(h) > 0 && height_at_head(h) < 0 && !seen_edge_[edge(h)] && hit(crossing(h)))
        return {};
    cut.pieces = convex_pieces(outline, tolerance_);
    if (cut.pieces.empty()) return {};
    return cut;
  }

  static Real area(std::span<const Vec2> outline) {
    Real sum = 0;
    for (std::size_t k = 1; k + 1 < outline.size(); ++k) {
      const Vec2 a = outline[k] - outline[0], b = outline[k + 1] - outline[0];
      sum += a.x() * b.y() - a.y() * b.x();
    }
    return sum;
  }

  const Polyhedron& p_;
  CutPlane plane_;
  Real tolerance_;
  Vec3 origin_, x_axis_, y_axis_;
  std::vector<Real> height_;  // by point: height over the plane, 0 within the tolerance; decided once
  std::vector<bool> seen_point_, seen_edge_, seen_face_;
};

}  // namespace

std::optional<Cut> trace_cut(const Polyhedron& p, uint32_t half_edge, const CutPlane& plane, Real tolerance) {
  return Tracer(p, plane, tolerance).trace(half_edge);
}

std::vector<Polyhedron> separate(Polyhedron p, const Cut& cut) {
  const std::size_t n = cut.corners.size();
  std::vector<uint32_t> leaving(n), origins(n), above(n), below(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Cut::Corner& c = cut.corners[k];
    if (c.on_edge) split_edge(p, c.half_edge, c.point);
    leaving[k] = c.on_edge ? p.half_edges[c.half_edge].next : c.half_edge;
    origins[k] = p.origin(leaving[k]);
  }
  // The inside of the cut is on the left of its outline, so the part on the left of a side, seen from outside
  // the solid, is above the plane.
  for (std::size_t k = 0; k < n; ++k) {
    above[k] = leaving[k];
    if (cut.corners[k].across_face) {
      uint32_t to = p.half_edges[leaving[k]].next;
      while (p.origin(to) != origins[(k + 1) % n]) to = p.half_edges[to].next;
      above[k] = split_face(p, leaving[k], to);
    }
  }
  for (std::size_t k = 0; k < n; ++k) below[k] = p.half_edges[above[k]].twin;
  add_cap(p, cut.pieces, origins, below, cut.plane, false);
  add_cap(p, cut.pieces, origins, above, {-cut.plane.normal, -cut.plane.offset}, true);
  return components(p);
}

}  // namespace offstage::sim
