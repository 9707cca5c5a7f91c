#include "sim/collision/manifold.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "sim/collision/contact_candidates.h"
#include "sim/collision/supporting_feature.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kMaxCorners = SupportingFeature::kMaxCorners;

/// One of the two solids in A's frame, with the data for the manifold.
struct Body {
  const Convex& convex;
  Mat3 rotation;
  Vec3 translation;
  Vec3 outward;   ///< direction towards the other solid
  uint32_t name;  ///< 0 for A, 1 for B

  Vec3 local(const Vec3& d) const { return rotation.transpose() * d; }
  /// Returns the point of the surface that is farthest along d.
  Vec3 support(const Vec3& d, uint32_t vertex) const {
    return rotation * convex.support(local(d), vertex) + translation + convex.radius * d;
  }
  SupportingFeature feature(Real slack) const {
    SupportingFeature f = supporting_feature(convex, local(outward), slack);
    f.place(rotation, translation);
    return f;
  }
  SupportingFeature edge(Real slack, const Vec3& on_surface) const {
    const Vec3 on_core = on_surface - convex.radius * outward - translation;
    SupportingFeature f = supporting_edge(convex, local(outward), slack, rotation.transpose() * on_core);
    f.place(rotation, translation);
    return f;
  }
};

// Clipping

/// A corner of the clipped incident feature, and the side that begins at this corner. The side is a side of
/// the incident feature or, with kMaxCorners added to its number, a side of the reference face.
struct Corner {
  Vec3 point;
  uint32_t id;
  uint32_t side;
};

struct Polygon {
  uint32_t count = 0;
  std::array<Corner, 2 * kMaxCorners> corners;

  void add(const Corner& c) {
    if (count < corners.size()) corners[count++] = c;
  }
};

/// Clips the incident feature against the planes that stand on the sides of the reference face (Sutherland
/// and Hodgman, "Reentrant polygon clipping", 1974). Segments and points are clipped as polygons with two
/// corners and one corner.
class Clipping {
 public:
  Clipping(const Body& reference_body, const SupportingFeature& reference, const Body& incident_body,
           const SupportingFeature& incident)
      : reference_body_(reference_body),
        reference_(reference),
        incident_body_(incident_body),
        incident_(incident) {
    for (uint32_t k = 0; k < incident.count; ++k)
      part_.add({incident.corners[k].point, vertex_id(incident_body.name, incident.corners[k].tag), k});
  }

  /// Cuts at all sides of the reference face. Points that are outside of a side by at most `slop` [m] are
  /// kept.
  void cut_all(Real slop) {
    for (uint32_t k = 0; k < reference_.count && part_.count > 0; ++k) cut(k, slop);
  }
  /// Cuts at side k of the reference face.
  void cut(uint32_t k, Real slop) {
    const Vec3& corner = reference_.corners[k].point;
    const Vec3& next = reference_.corners[(k + 1) % reference_.count].point;
    const Vec3 inward = reference_.normal.cross(next - corner).normalized();
    std::array<Real, 2 * kMaxCorners> inside;
    bool all_inside = true;
    for (uint32_t i = 0; i < part_.count; ++i) {
      inside[i] = inward.dot(part_.corners[i].point - corner) + slop;
      all_inside &= inside[i] >= 0;
    }
    if (all_inside) return;
    Polygon whole;
    for (; whole.count < part_.count; ++whole.count) whole.corners[whole.count] = part_.corners[whole.count];
    part_.count = 0;
    for (uint32_t i = 0; i < whole.count; ++i) {
      const uint32_t j = (i + 1) % whole.count;
      const Corner &from = whole.corners[i], &to = whole.corners[j];
      const Real here = inside[i], there = inside[j];
      if (here >= 0) part_.add(from);
      if ((here >= 0) != (there >= 0))
        part_.add({from.point + here / (here - there) * (to.point - from.point), id_of_crossing(from.side, k),
                   here >= 0 ? kMaxCorners + k : from.side});
    }
  }

  std::span<const Corner> corners() const { return {part_.corners.data(), part_.count}; }

 private:
  uint32_t tag_of(const SupportingFeature& f, uint32_t corner) const {
    return f.corners[corner % f.count].tag;
  }
  uint32_t side_id(const SupportingFeature& f, uint32_t k) const {
    return edge_id(tag_of(f, k), tag_of(f, k + 1));
  }

  /// Returns the id of a crossing. If both sides are neighbouring sides of the reference face, the crossing
  /// is a vertex of this face.
  uint32_t id_of_crossing(uint32_t side, uint32_t reference_side) const {
    const uint32_t cut = side_id(reference_, reference_side);
    if (side < kMaxCorners) return crossing_id(incident_body_.name, side_id(incident_, side), cut);
    const uint32_t other = side - kMaxCorners;
    if ((other + 1) % reference_.count == reference_side)
      return vertex_id(reference_body_.name, tag_of(reference_, reference_side));
    if ((reference_side + 1) % reference_.count == other)
      return vertex_id(reference_body_.name, tag_of(reference_, other));
    return mixed(side_id(reference_, other), cut);
  }

  const Body& reference_body_;
  const SupportingFeature& reference_;
  const Body& incident_body_;
  const SupportingFeature& incident_;
  Polygon part_;
};

// Kinds of contact

/// Returns the sine of the angle between a face of `reference` and the plane perpendicular to the normal of
/// the separation. Returns 2, more than kMaxTilt, if the face cannot give the contact normal.
Real tilt(const Body& reference, const SupportingFeature& f, const Body& incident, uint32_t incident_vertex,
          const Separation& s, Real tolerance) {
  constexpr Real kNever = 2;
  if (!f.is_face() || f.normal.dot(reference.outward) <= 0) return kNever;
  const Real sine = f.normal.cross(reference.outward).norm();
  if (sine > kMaxTilt || std::abs(s.distance) * sine > tolerance) return kNever;
  const Vec3 on_reference = f.on_face + reference.convex.radius * f.normal;
  const Real gap = f.normal.dot(incident.support(-f.normal, incident_vertex) - on_reference);
  return s.distance - gap <= tolerance ? sine : kNever;
}

/// Whether the solid can roll, so that the material of its surface moves through the contact point.
bool is_round(const Convex& c) {
  using Core = Convex::Core;
  return c.core == Core::point || c.core == Core::segment || c.core == Core::cylinder ||
         c.core == Core::cone || c.core == Core::ellipsoid || c.core == Core::sector;
}

/// Whether a point is directly above or below a face. It may be outside of the face's sides by at most `slop`
/// [m].
bool is_over(const SupportingFeature& face, const Vec3& point, Real slop) {
  for (uint32_t k = 0; k < face.count; ++k) {
    const Vec3& corner = face.corners[k].point;
    const Vec3 side = face.corners[(k + 1) % face.count].point - corner;
    if (face.normal.cross(side).normalized().dot(point - corner) < -slop) return false;
  }
  return true;
}

/// Adds the contact with a face that gives the normal. `closest` is the closest point on the incident solid;
/// for a rim it may be deeper than the corners of the rim's polygon. The feature of a round solid is the line
/// or point that faces the face. If this is not over the face, there are no points: at the line nearest to an
/// edge of the face, the face would push the solid along its normal although the solid rolls down to the
/// face.
void face_manifold(Manifold& m, const Body& reference, const SupportingFeature& face, Body incident,
                   SupportingFeature other, const Vec3& closest, Real margin, Real slack, Real slop,
                   Manifold* more) {
  const Vec3 n = face.normal;
  const bool on_a = reference.name == 0, round = is_round(incident.convex);
  m.normal = on_a ? Vec3(-n) : n;
  m.source = on_a ? NormalSource::face_of_a : NormalSource::face_of_b;
  if (round) {
    incident.outward = -n;
    other = incident.feature(slack);
  }
  const Real offset = n.dot(face.on_face) + reference.convex.radius;
  Candidates candidates;
  const auto add = [&](const Vec3& on_incident, uint32_t id) {
    const Real separation = n.dot(on_incident) - offset;
    if (separation > margin) return;
    const Vec3 on_reference = on_incident - separation * n;
    candidates.add(on_a ? Candidate{on_reference, on_incident, separation, id}
                        : Candidate{on_incident, on_reference, separation, id});
  };
  Clipping part(reference, face, incident, other);
  part.cut_all(slop);
  for (const Corner& c : part.corners()) add(c.point - incident.convex.radius * n, c.id);
  const bool none = candidates.count == 0;
  if (none ? !round && is_over(face, closest, slop)
           : n.dot(closest) - offset < candidates.least_separation() - slop)
    add(closest, closest_id(incident.name));
  reduce(m, candidates, slop, more);
}

/// Whether a part of the surface other than the touching edge or vertex may come near a face.
bool is_near(const Body& body, const SupportingFeature& f) {
  return f.is_face() && f.normal.dot(body.outward) > kNearFace;
}

/// Handles two parallel edges as closest features: adds the ends of the segment along which they run side by
/// side.
void parallel_edges(Manifold& m, const Body& a, const SupportingFeature& of_a, const Body& b,
                    const SupportingFeature& of_b, Real distance, Real margin, Real tolerance) {
  if (of_a.count < 2 || of_b.count < 2) return;
  const Vec3 &p = of_a.corners[0].point, &q = of_b.corners[0].point;
  const Vec3 u = of_a.corners[1].point - p, w = of_b.corners[1].point - q;
  // These are values in a projection along the normal, in units of B's edge: where A's edge begins, how far
  // it extends, and where it passes the ends of B's edge.
  const Vec3 across = m.normal.cross(w), on_plane = across.cross(m.normal);
  if (across.squaredNorm() < 0.5 * w.squaredNorm()) return;
  const Real start = (p - q).dot(on_plane) / across.squaredNorm(),
             along = u.dot(on_plane) / across.squaredNorm();
  if (along == 0) return;
  std::pair<Real, uint32_t> low{-start / along, vertex_id(b.name, of_b.corners[0].tag)},
      high{(1 - start) / along, vertex_id(b.name, of_b.corners[1].tag)};
  if (along < 0) std::swap(low, high);
  if (low.first <= 0) low = {0, vertex_id(a.name, of_a.corners[0].tag)};
  if (high.first >= 1) high = {1, vertex_id(a.name, of_a.corners[1].tag)};
  if ((high.first - low.first) * u.norm() <= tolerance) return;

  Candidates ends;
  for (const auto& [t, id] : {low, high}) {
    const Vec3 gap = p + t * u - q - (start + t * along) * w;
    const Real separation = gap.dot(m.normal) - a.convex.radius - b.convex.radius;
    if (std::abs(gap.dot(across)) > tolerance * across.norm() || separation > margin) return;
    const Vec3 on_a = p + t * u - a.convex.radius * m.normal;
    ends.add({on_a, on_a - separation * m.normal, separation, id});
  }
  if (ends.least_separation() <= distance + tolerance) reduce(m, ends, 0);
}

/// Returns the id of an edge or a vertex.
uint32_t feature_id(const Body& body, const SupportingFeature& f) {
  return f.edge != Vec3::Zero() ? edge_id(f.corners[0].tag, f.corners[f.count - 1].tag)
                                : vertex_id(body.name, f.corners[0].tag);
}

/// Adds the contact of edges and vertices, for the case that no face gives the normal.
void edge_manifold(Manifold& m, const Body& a, const Body& b, const Separation& s, Real margin, Real slack,
                   Real tolerance) {
  const SupportingFeature of_a = a.edge(slack, s.on_a), of_b = b.edge(slack, s.on_b);
  const bool across_a = of_a.edge != Vec3::Zero(), across_b = of_b.edge != Vec3::Zero();
  m.source = across_b ? NormalSource::edge_of_b : across_a ? NormalSource::edge_of_a : NormalSource::points;
  m.edge_a = of_a.edge;
  m.edge_b = of_b.edge;
  m.radius_a = a.convex.radius + of_a.rod;
  m.radius_b = b.convex.radius + of_b.rod;
  parallel_edges(m, a, of_a, b, of_b, s.distance, margin, tolerance);
  if (m.count > 0) return;
  if (across_a && across_b && of_a.edge.cross(of_b.edge).norm() > kParallel) m.source = NormalSource::edges;
  m.count = 1;
  m.points[0] = {s.on_a, s.on_b, s.distance, mixed(feature_id(a, of_a), feature_id(b, of_b))};
}

}  // namespace

Manifold manifold(const Convex& a, const Convex& b, const Pose& a_from_b, const Separation& s, Real margin,
                  MoreManifolds* more) {
  Manifold m;
  m.normal = s.normal;
  if (!(s.distance <= margin)) return m;
  const Body body_a{a, Mat3::Identity(), Vec3::Zero(), -s.normal, 0};
  const Body body_b{b, a_from_b.orientation.toRotationMatrix(), a_from_b.position, s.normal, 1};
  const Real rounding = kSeparationRounding * (a.reach() + b.reach()), slack = margin + rounding;
  const Real tolerance = kTilt * margin + rounding, slop = kRim * margin + rounding;

  const SupportingFeature of_a = body_a.feature(slack), of_b = body_b.feature(slack);
  const Real tilt_a = tilt(body_a, of_a, body_b, of_b.vertex, s, tolerance),
             tilt_b = tilt(body_b, of_b, body_a, of_a.vertex, s, tolerance);
  const bool by_a = a_gives_normal(tilt_a, tilt_b, a.reach(), b.reach());
  if (std::min(tilt_a, tilt_b) <= kMaxTilt) {
    Manifold* const left_out = more ? &more->manifolds[0] : nullptr;
    if (by_a)
      face_manifold(m, body_a, of_a, body_b, of_b, s.on_b, margin, slack, slop, left_out);
    else
      face_manifold(m, body_b, of_b, body_a, of_a, s.on_a, margin, slack, slop, left_out);
    if (m.count > 0) return m;
    m = {};
    m.normal = s.normal;
  }
  edge_manifold(m, body_a, body_b, s, margin, slack, tolerance);
  if (!more) return m;
  auto& [face, left_out] = more->manifolds;
  if (is_near(body_a, of_a) && (by_a || !is_near(body_b, of_b)))
    face_manifold(face, body_a, of_a, body_b, of_b, s.on_b, margin, slack, slop, &left_out);
  else if (is_near(body_b, of_b))
    face_manifold(face, body_b, of_b, body_a, of_a, s.on_a, margin, slack, slop, &left_out);
  for (Manifold& near : more->manifolds) drop_below(near, std::min(0.0, s.distance) + slop);
  return m;
}

Manifold triangle_face_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, bool of_b,
                                const Vec3& up, const std::array<Real, 3>& beyond, Real margin) {
  Manifold m;
  m.normal = of_b ? up : Vec3(-up);
  m.source = of_b ? NormalSource::face_of_b : NormalSource::face_of_a;
  const Body body_a{a, Mat3::Identity(), Vec3::Zero(), -m.normal, 0};
  const Body body_b{b, a_from_b.orientation.toRotationMatrix(), a_from_b.position, m.normal, 1};
  const Body &reference = of_b ? body_b : body_a, &incident = of_b ? body_a : body_b;
  const Real rounding = kSeparationRounding * (a.reach() + b.reach()), slop = kRim * margin + rounding;
  const SupportingFeature face = reference.feature(0), other = incident.feature(margin + rounding);
  if (!face.is_face()) return m;

  // The room beyond each side. If the other body is behind the triangle, the face has the triangle's sides in
  // the opposite order.
  std::array<Real, 3> room;
  for (uint32_t k = 0; k < 3; ++k) {
    const uint32_t from = face.corners[k].tag, to = face.corners[(k + 1) % 3].tag;
    room[k] = slop + beyond[to == (from + 1) % 3 ? from : to];
  }
  const Real offset = up.dot(face.on_face);
  const Vec3 deepest = incident.support(-up, other.vertex);
  const Real level = up.dot(deepest) - offset + slop;
  Candidates candidates;
  const auto room_inside = [&](const Vec3& p, uint32_t k) {
    const Vec3& corner = face.corners[k].point;
    return up.cross(face.corners[(k + 1) % 3].point - corner).normalized().dot(p - corner);
  };
  const auto add = [&](const Vec3& p, uint32_t id, bool is_corner) {
    const Real separation = up.dot(p) - offset;
    if (separation > (is_corner ? margin : std::min(margin, level))) return;
    // What is below the plane beyond a valley either penetrates the surface there, which has its own
    // contacts, or the surface has fallen again below the plane.
    if (separation < -slop)
      for (uint32_t k = 0; k < 3; ++k)
        if (room_inside(p, k) < -slop) return;
    const Vec3 on_face = p - separation * up;
    candidates.add(of_b ? Candidate{p, on_face, separation, id} : Candidate{on_face, p, separation, id});
  };
  Clipping part(reference, face, incident, other);
  bool is_before = true;
  for (uint32_t k = 0; k < 3; ++k) {
    part.cut(k, room[k]);
    is_before &= room_inside(deepest, k) + room[k] >= 0;
  }
  for (const Corner& c : part.corners()) {
    bool is_corner = false;
    for (uint32_t k = 0; k < other.count; ++k)
      is_corner |= c.id == vertex_id(incident.name, other.corners[k].tag);
    add(c.point - incident.convex.radius * up, c.id, is_corner);
  }
  if (is_before && level - slop < candidates.least_separation() - slop)
    add(deepest, closest_id(incident.name), true);
  reduce(m, candidates, slop);
  return m;
}

Manifold placed(const Manifold& m, const Pose& pose) {
  const Mat3 R = pose.orientation.toRotationMatrix();
  Manifold result = m;
  result.normal = R * m.normal;
  result.edge_a = R * m.edge_a;
  result.edge_b = R * m.edge_b;
  for (uint32_t k = 0; k < m.count; ++k) {
    result.points[k].on_a = R * m.points[k].on_a + pose.position;
    result.points[k].on_b = R * m.points[k].on_b + pose.position;
  }
  return result;
}

Manifold plane_manifold(const Convex& a, const Pose& plane_from_a, Real margin) {
  const Body body{a, plane_from_a.orientation.toRotationMatrix(), plane_from_a.position, -Vec3::UnitY(), 0};
  const Real rounding = kSeparationRounding * a.reach();
  const SupportingFeature feature = body.feature(margin + rounding);
  Manifold m;
  m.source = NormalSource::face_of_b;
  Candidates candidates;
  const auto add = [&](const Vec3& p, uint32_t id) {
    if (p.y() <= margin) candidates.add({p, Vec3(p.x(), 0, p.z()), p.y(), id});
  };
  for (uint32_t k = 0; k < feature.count; ++k)
    add(feature.corners[k].point - a.radius * Vec3::UnitY(), vertex_id(body.name, feature.corners[k].tag));
  // The lowest point of a rim may be between the corners of its polygon.
  const Vec3 lowest = body.support(body.outward, feature.vertex);
  if (lowest.y() < candidates.least_separation() - (kRim * margin + rounding)) add(lowest, closest_id(0));
  reduce(m, candidates, kRim * margin + rounding);
  return m;
}

}  // namespace offstage::sim
