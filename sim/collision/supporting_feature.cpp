#include "sim/collision/supporting_feature.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace offstage::sim {
namespace {

constexpr uint32_t kMaxFeatureCorners = SupportingFeature::kMaxCorners;

/// Vertices that are less than this fraction of the solid's size below the plane of a face belong to the
/// face. Coordinates from files are seldom more accurate, and flat faces are often given as triangles that
/// are not exactly coplanar.
constexpr Real kFlat = 1e-5;
/// An edge and a direction count as perpendicular if the cosine of their angle is below this. Normals of
/// round solids are accurate to the square root of the accuracy of distances.
constexpr Real kAcross = 1e-4;

/// First tag for the ends of a line on a round side. The corners on rims have smaller tags.
constexpr uint32_t kLineTag = 2 * kMaxFeatureCorners;

/// Returns directions around the circle. Angles are halved with square roots, for the same bits on every
/// machine.
const std::array<Eigen::Vector2d, kMaxFeatureCorners>& circle() {
  static const std::array<Eigen::Vector2d, kMaxFeatureCorners> points = [] {
    Real cosine = 0;  // cosine of a quarter turn
    for (uint32_t parts = 4; parts < kMaxFeatureCorners; parts *= 2) cosine = std::sqrt((1 + cosine) / 2);
    const Eigen::Matrix2d turn{{cosine, -std::sqrt(1 - cosine * cosine)},
                               {std::sqrt(1 - cosine * cosine), cosine}};
    std::array<Eigen::Vector2d, kMaxFeatureCorners> result;
    result[0] = Eigen::Vector2d::UnitX();
    for (uint32_t k = 1; k < kMaxFeatureCorners; ++k)
      result[k] = k % (kMaxFeatureCorners / 4) == 0 ? Eigen::Vector2d(-result[k - kMaxFeatureCorners / 4].y(),
                                                                      result[k - kMaxFeatureCorners / 4].x())
                                                    : Eigen::Vector2d(turn * result[k - 1]);
    return result;
  }();
  return points;
}

/// Returns the fraction of a length that is within `slack` [m] of a plane, if its near end is on the plane
/// and its far end is `rise` [m] away.
Real fraction_within(Real slack, Real rise) {
  return rise > slack ? slack / rise : 1;
}

SupportingFeature point_feature(const Vec3& p, uint32_t tag) {
  SupportingFeature f;
  f.add(p, tag);
  f.vertex = tag;
  return f;
}

SupportingFeature segment_feature(const Vec3& p, uint32_t p_tag, const Vec3& q, uint32_t q_tag,
                                  const Vec3& d) {
  SupportingFeature f = point_feature(p, p_tag);
  f.add(q, q_tag);
  const Vec3 along = (q - p).normalized();
  if (std::abs(along.dot(d)) <= kAcross) f.edge = along;
  return f;
}

// Box

Vec3 box_extent(const Vec3& half, const Vec3& d, Real slack) {
  Vec3 extent = 2 * half;
  for (int i = 0; i < 3; ++i) extent[i] *= fraction_within(slack, extent[i] * std::abs(d[i]));
  return extent;
}

SupportingFeature box_face(const Convex& c, const Vec3& d, Real slack) {
  const Vec3 extent = box_extent(c.half, d, slack);
  int axis = 0;
  Real best = -1;
  for (int i = 0; i < 3; ++i) {
    const Real patch = extent[(i + 1) % 3] * extent[(i + 2) % 3] * std::abs(d[i]);
    if (patch <= best) continue;
    best = patch;
    axis = i;
  }
  const uint32_t side = d[axis] > 0, i = static_cast<uint32_t>(axis), j = (i + 1) % 3, k = (i + 2) % 3;
  SupportingFeature f;
  f.normal[axis] = side ? 1 : -1;
  for (uint32_t corner = 0; corner < 4; ++corner) {
    // The order is counter-clockwise about +axis: (-,-) (+,-) (+,+) (-,+).
    const uint32_t at = side ? corner : 3 - corner, right = at == 1 || at == 2, up = at >= 2;
    const uint32_t tag = side << i | right << j | up << k;
    f.add(c.vertex(tag), tag);
  }
  f.vertex = f.corners[0].tag;
  f.on_face = f.corners[0].point;
  return f;
}

SupportingFeature box_edge(const Convex& c, const Vec3& d, Real slack) {
  const Vec3 extent = box_extent(c.half, d, slack);
  uint32_t corner = 0;
  c.support(d, corner);
  int axis = 0, across = 0;
  for (int i = 1; i < 3; ++i) {
    if (extent[i] > extent[axis]) axis = i;
    if (std::abs(d[i]) < std::abs(d[across])) across = i;
  }
  if (std::abs(d[across]) <= kAcross) axis = across;
  const uint32_t other = corner ^ (1u << axis);
  return segment_feature(c.vertex(corner), corner, c.vertex(other), other, d);
}

// Triangle

/// Returns the side of the triangle that faces d; an edge if the triangle has no area.
SupportingFeature triangle_face(const Convex& c, const Vec3& d, Real slack) {
  const Vec3 &p = *c.corners[0], &q = *c.corners[1], &r = *c.corners[2];
  const Vec3 area = (q - p).cross(r - p);
  const Real longest2 = std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()});
  if (!(area.norm() > kFlat * longest2)) return supporting_edge(c, d, slack, Vec3::Zero());
  const bool front = area.dot(d) > 0;
  SupportingFeature f;
  f.normal = (front ? 1 : -1) * area.normalized();
  for (uint32_t k = 0; k < 3; ++k) {
    const uint32_t corner = front ? k : 2 - k;
    f.add(*c.corners[corner], corner);
  }
  f.on_face = f.corners[0].point;
  return f;
}

/// Returns one of the two edges at the touching corner: an edge perpendicular to d, or else the edge with the
/// longest part within `slack` [m].
SupportingFeature triangle_edge(const Convex& c, const Vec3& d, Real slack) {
  uint32_t corner = 0;
  const Vec3 top = c.support(d, corner);
  SupportingFeature best;
  Real best_length = -1;
  for (const uint32_t other : {(corner + 1) % 3, (corner + 2) % 3}) {
    const Vec3 edge = c.vertex(other) - top;
    const SupportingFeature f = segment_feature(top, corner, c.vertex(other), other, d);
    const Real length = f.edge != Vec3::Zero() ? std::numeric_limits<Real>::infinity()
                                               : fraction_within(slack, -d.dot(edge)) * edge.norm();
    if (!(edge.squaredNorm() > 0) || length <= best_length) continue;
    best = f;
    best_length = length;
  }
  return best.count > 0 ? best : point_feature(top, corner);
}

// Polyhedron

/// Selects the corners of a planar set of points that are farthest in evenly spaced directions. They are the
/// corners of the hull, except blunt corners between two of these directions.
void spread_corners(SupportingFeature& f, const ConvexPolyhedron& p, std::span<const uint32_t> vertices,
                    const Vec3& u) {
  const Vec3 w = f.normal.cross(u);
  f.count = 0;
  for (const Eigen::Vector2d& direction : circle()) {
    const Vec3 d = direction.x() * u + direction.y() * w;
    uint32_t best = vertices[0];
    for (uint32_t v : vertices)
      if (d.dot(p.vertex(v)) > d.dot(p.vertex(best))) best = v;
    if (f.count == 0 || (f.corners[f.count - 1].tag != best && f.corners[0].tag != best))
      f.add(p.vertex(best), best);
  }
}

/// Returns a face together with the vertices around it that are almost in its plane.
SupportingFeature flat_part(const ConvexPolyhedron& p, uint32_t face) {
  const ConvexPolyhedron::Plane& plane = p.plane(face);
  const std::span<const uint32_t> loop = p.face_vertices(face);
  const Vec3& along = p.edge_frame(p.face_edges(face)[0]).along;
  SupportingFeature f;
  f.normal = plane.normal;
  f.on_face = p.vertex(loop[0]);

  constexpr std::size_t kMaxVertices = 256;
  std::array<uint32_t, kMaxVertices> vertices;
  if (loop.size() > kMaxVertices) {
    spread_corners(f, p, loop, along);
    return f;
  }
  std::size_t count = loop.size();
  std::copy(loop.begin(), loop.end(), vertices.begin());
  const Real least = plane.offset - kFlat * p.reach();
  for (std::size_t i = 0; i < count; ++i)
    for (uint32_t v : p.vertex_neighbours(vertices[i])) {
      if (count == kMaxVertices || plane.normal.dot(p.vertex(v)) < least) continue;
      if (std::find(vertices.begin(), vertices.begin() + count, v) == vertices.begin() + count)
        vertices[count++] = v;
    }

  if (count == loop.size() && count <= kMaxFeatureCorners)
    for (uint32_t v : loop) f.add(p.vertex(v), v);
  else
    spread_corners(f, p, {vertices.data(), count}, along);
  return f;
}

/// Returns the part of an edge that is within `slack` [m] of its first vertex along d, as a vector from this
/// vertex.
Vec3 part_within(const ConvexPolyhedron& p, uint32_t from, uint32_t to, const Vec3& d, Real slack) {
  const Vec3 edge = p.vertex(to) - p.vertex(from);
  return fraction_within(slack, -d.dot(edge)) * edge;
}

SupportingFeature polyhedron_edge(const ConvexPolyhedron& p, const Vec3& d, Real slack, uint32_t v) {
  if (p.edges().empty()) return point_feature(p.vertex(v), v);
  const auto slope = [&](uint32_t e) { return std::abs(d.dot(p.edge_frame(e).along)); };
  const std::span<const uint32_t> edges = p.vertex_edges(v), ends = p.vertex_neighbours(v);
  std::size_t longest = 0, across = 0;
  Real length2 = -1;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (slope(edges[k]) < slope(edges[across])) across = k;
    const Real within2 = part_within(p, v, ends[k], d, slack).squaredNorm();
    if (within2 <= length2) continue;
    length2 = within2;
    longest = k;
  }
  const uint32_t end = ends[slope(edges[across]) <= kAcross ? across : longest];
  return segment_feature(p.vertex(v), v, p.vertex(end), end, d);
}

/// Returns the area, projected along d, of the part of a face that is within `slack` of its vertex v along d.
/// The two sides at v are not sufficient for it: in a polygon of many corners they are short and almost in
/// line.
Real patch_within(const ConvexPolyhedron& p, uint32_t face, uint32_t v, const Vec3& d, Real slack) {
  const std::span<const uint32_t> loop = p.face_vertices(face);
  const auto start = static_cast<std::size_t>(std::find(loop.begin(), loop.end(), v) - loop.begin());
  const Vec3& top = p.vertex(v);
  Vec3 corner = Vec3::Zero(), last = Vec3::Zero();  // relative to v; corners of the face and of its part
  Real height = slack, doubled = 0;                 // height of a corner above the lower end of the part
  const auto add = [&](const Vec3& next) {
    doubled += d.dot(last.cross(next));
    last = next;
  };
  for (std::size_t k = 1; k < loop.size(); ++k) {
    const Vec3 next = p.vertex(loop[(start + k) % loop.size()]) - top;
    const Real next_height = slack + d.dot(next);
    if ((height >= 0) != (next_height >= 0)) add(corner + height / (height - next_height) * (next - corner));
    if (next_height >= 0) add(next);
    corner = next;
    height = next_height;
  }
  // This is the side from the last corner back to v.
  if (height < 0) add(corner - height / (height - slack) * corner);
  return std::max(0.0, doubled / 2);
}

SupportingFeature polyhedron_face(const ConvexPolyhedron& p, const Vec3& d, Real slack, uint32_t v) {
  if (p.dimension() < 2) return polyhedron_edge(p, d, slack, v);
  uint32_t face = kNoFace;
  Real best = -1;
  for (uint32_t e : p.vertex_edges(v)) {
    const uint32_t f = p.edge(e).tail == v ? p.edge(e).left : p.edge(e).right;
    const Real patch = patch_within(p, f, v, d, slack);
    if (patch <= best) continue;
    best = patch;
    face = f;
  }
  return flat_part(p, face);
}

// Solids of revolution

/// Returns the radial direction of d, away from the axis.
Vec3 outward(const Vec3& d) {
  const Real rho = std::sqrt(d.x() * d.x() + d.z() * d.z());
  return rho > 0 ? Vec3(d.x() / rho, 0, d.z() / rho) : Vec3::UnitX();
}

SupportingFeature disc(Real radius, Real y, bool up) {
  SupportingFeature f;
  f.normal = up ? Vec3::UnitY() : Vec3(-Vec3::UnitY());
  for (uint32_t k = 0; k < kMaxFeatureCorners; ++k) {
    // From +X towards +Z is clockwise seen from +Y.
    const uint32_t at = up ? kMaxFeatureCorners - 1 - k : k;
    f.add({radius * circle()[at].x(), y, radius * circle()[at].y()}, at + (up ? kMaxFeatureCorners : 0));
  }
  f.on_face = Vec3(0, y, 0);
  return f;
}

/// The line of the round side that faces d, and the outward normal there. `from` is the end of the line that
/// is farther along d; if both ends are equally far, it is the end at the base.
struct RoundSide {
  Vec3 from, to, normal;
  uint32_t from_tag = kLineTag, to_tag = kLineTag + 1;
};

RoundSide round_side(const Convex& c, const Vec3& d) {
  const Real R = c.half.x(), h = c.half.y(), top = c.core == Convex::Core::cone ? c.half.z() : R;
  const Vec3 out = outward(d);
  RoundSide side{out * R - h * Vec3::UnitY(), out * top + h * Vec3::UnitY(),
                 (2 * h * out + (R - top) * Vec3::UnitY()).normalized()};
  if (d.dot(side.to) > d.dot(side.from)) {
    std::swap(side.from, side.to);
    std::swap(side.from_tag, side.to_tag);
  }
  return side;
}

/// Returns the radius of the upper or the lower disc [m].
Real disc_radius(const Convex& c, bool up) {
  return up && c.core == Convex::Core::cone ? c.half.z() : c.half.x();
}

/// Whether the solid is a disc without a round side, which has a radius around it.
bool is_flat_disc(const Convex& c) {
  return !(c.half.y() > 0);
}

/// Whether a larger part of the flat side than of the round side is within `slack`. Both parts are about
/// equally wide across the plane through d and the axis, so their lengths in this plane decide.
bool rests_on_disc(const Convex& c, const RoundSide& side, const Vec3& d, Real slack) {
  const bool up = d.y() > 0;
  if (up && c.core == Convex::Core::cone && !(c.half.z() > 0)) return false;
  const Real R = disc_radius(c, up), lean = d.dot(outward(d)), length = (side.to - side.from).norm();
  if (is_flat_disc(c)) return 2 * R * lean <= slack;
  const Real disc_within = 2 * R * fraction_within(slack, 2 * R * lean) * std::abs(d.y()),
             line_within = length * fraction_within(slack, d.dot(side.from - side.to)) * d.dot(side.normal);
  return disc_within > line_within;
}

SupportingFeature revolved(const Convex& c, const Vec3& d, Real slack) {
  const RoundSide side = round_side(c, d);
  if (rests_on_disc(c, side, d, slack))
    return disc(disc_radius(c, d.y() > 0), std::copysign(c.half.y(), d.y()), d.y() > 0);
  if (is_flat_disc(c)) return point_feature(side.from, side.from_tag);
  return segment_feature(side.from, side.from_tag, side.to, side.to_tag, d);
}

/// Returns the line of the round side if it is perpendicular to d, or almost perpendicular while the solid
/// does not rest on a disc. Otherwise returns the rim, whose tangent is always perpendicular, or the apex.
SupportingFeature revolved_edge(const Convex& c, const Vec3& d, Real slack, const Vec3& on_surface) {
  const RoundSide side = round_side(c, d);
  SupportingFeature line = segment_feature(side.from, side.from_tag, side.to, side.to_tag, d);
  if (line.edge != Vec3::Zero()) {
    // The centre of curvature of a cone is the intersection of the normal with the axis.
    line.rod = std::max(0.0, outward(d).dot(on_surface)) / side.normal.dot(outward(d));
    return line;
  }
  const bool apex = c.core == Convex::Core::cone && !(c.half.z() > 0) && side.from.y() > 0;
  if (is_flat_disc(c) || rests_on_disc(c, side, d, slack)) line.count = 1;
  if (!apex) line.edge = Vec3::UnitY().cross(outward(d));
  return line;
}

// Sector of a ring

/// Returns a flat side of a sector: one of the two ends along Y, the inside, or one of the two sides on which
/// the neighbours in the ring lie.
SupportingFeature sector_face(const Convex& c, const Vec3& d) {
  const Real h = c.half.y(), across = c.cosine * d.x();
  const auto corner = [&](bool outer, bool up, bool beyond) {
    const Real r = outer ? c.half.x() : c.half.z();
    return Vec3(r * c.cosine, up ? h : -h, beyond ? r * c.sine : -r * c.sine);
  };
  SupportingFeature f;
  const auto add = [&](bool outer, bool up, bool beyond) {
    f.add(corner(outer, up, beyond), (outer ? 1u : 0u) | (up ? 2u : 0u) | (beyond ? 4u : 0u));
  };
  const bool up = d.y() > 0, beyond = d.z() > 0;
  const Real side = (beyond ? d.z() : -d.z()) * c.cosine - c.sine * d.x();
  if (std::abs(d.y()) >= std::max(side, -across)) {
    f.normal = up ? Vec3::UnitY() : Vec3(-Vec3::UnitY());
    constexpr std::array<std::pair<bool, bool>, 4> kAround = {
        {{false, false}, {false, true}, {true, true}, {true, false}}};  // counter-clockwise from above
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& [outer, far] = kAround[up ? k : 3 - k];
      add(outer, up, far);
      // The arc between the outer corners has one further corner.
      const auto& [next_outer, next_far] = kAround[up ? (k + 1) % 4 : (6 - k) % 4];
      if (outer && next_outer) f.add(Vec3(c.half.x(), up ? h : -h, 0), up ? 8 : 9);
    }
  } else if (side > -across) {
    f.normal = Vec3(-c.sine, 0, beyond ? c.cosine : -c.cosine);
    const std::array<std::pair<bool, bool>, 4> around = {
        {{false, false}, {true, false}, {true, true}, {false, true}}};  // outer, up
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& [outer, high] = around[beyond ? k : 3 - k];
      add(outer, high, beyond);
    }
  } else {
    f.normal = -Vec3::UnitX();
    const std::array<std::pair<bool, bool>, 4> around = {
        {{false, false}, {false, true}, {true, true}, {true, false}}};  // up, beyond
    for (const auto& [high, far] : around) add(false, high, far);
  }
  f.on_face = f.corners[0].point;
  f.vertex = f.corners[0].tag;
  return f;
}

/// Returns the radial direction of the arc's point that is farthest along d.
Vec3 arc_direction(const Convex& c, const Vec3& d) {
  if (c.faces_arc(d)) return outward(d);
  return {c.cosine, 0, std::copysign(c.sine, d.z())};
}

/// Returns the line of the round side at the angle of d, or the point of the arc if the sector is flat.
SupportingFeature sector_line(const Convex& c, const Vec3& d) {
  const Vec3 out = c.half.x() * arc_direction(c, d);
  const Vec3 up = std::copysign(c.half.y(), d.y()) * Vec3::UnitY();
  const bool is_up = d.y() > 0;
  SupportingFeature line = segment_feature(out + up, is_up ? kLineTag + 1 : kLineTag, out - up,
                                           is_up ? kLineTag : kLineTag + 1, d);
  if (!(c.half.y() > 0)) {
    line = point_feature(out, kLineTag);
    line.edge = Vec3::UnitY().cross(out).normalized();
  }
  return line;
}

SupportingFeature sector_feature(const Convex& c, const Vec3& d, Real slack) {
  const Real lean = d.dot(arc_direction(c, d)), width = c.half.x() - c.half.z(), length = 2 * c.half.y();
  if (!(length > 0)) return sector_line(c, d);  // of a torus, which touches with its arc
  const Real side = std::abs(d.z()) * c.cosine - c.sine * d.x();
  const Real flat = width * fraction_within(slack, width * std::abs(lean)) * std::abs(d.y()),
             round = length * fraction_within(slack, length * std::abs(d.y())) * lean;
  return lean > std::max(side, -d.x()) && round >= flat ? sector_line(c, d) : sector_face(c, d);
}

SupportingFeature sector_edge(const Convex& c, const Vec3& d, const Vec3& on_surface) {
  SupportingFeature line = sector_line(c, d);
  if (c.half.y() > 0 && line.edge != Vec3::Zero())
    line.rod = std::max(0.0, arc_direction(c, d).dot(on_surface));
  if (c.half.y() > 0 && line.edge == Vec3::Zero()) {
    line.count = 1;
    line.edge = Vec3::UnitY().cross(outward(d));
  }
  return line;
}

/// Returns the touching point of an ellipsoid, with the radius of the ball of the same Gaussian curvature:
/// r_1 r_2 r_3 / |h|^2 with the support h. For a ball this is exact.
SupportingFeature ellipsoid_point(const Convex& c, const Vec3& d) {
  uint32_t none = 0;
  SupportingFeature f = point_feature(c.support(d, none), 0);
  const Real height = c.half.cwiseProduct(d).norm();
  f.rod = height > 0 ? c.half.prod() / (height * height) : 0;
  return f;
}

SupportingFeature core_edge(const Convex& c, const Vec3& d, Real slack, const Vec3& on_surface) {
  switch (c.core) {
    case Convex::Core::point:
      return point_feature(Vec3::Zero(), 0);
    case Convex::Core::segment: {
      if (!(c.half.y() > 0)) return point_feature(Vec3::Zero(), 0);
      const uint32_t end = d.y() > 0;
      return segment_feature(c.vertex(end), end, c.vertex(1 - end), 1 - end, d);
    }
    case Convex::Core::triangle:
      return triangle_edge(c, d, slack);
    case Convex::Core::box:
      return box_edge(c, d, slack);
    case Convex::Core::cylinder:
    case Convex::Core::cone:
      return revolved_edge(c, d, slack, on_surface);
    case Convex::Core::ellipsoid:
      return ellipsoid_point(c, d);
    case Convex::Core::sector:
      return sector_edge(c, d, on_surface);
    case Convex::Core::polyhedron:
      return polyhedron_edge(*c.polyhedron, d, slack, support_vertex(*c.polyhedron, d, 0));
  }
  return {};
}

SupportingFeature core_feature(const Convex& c, const Vec3& d, Real slack) {
  switch (c.core) {
    case Convex::Core::triangle:
      return triangle_face(c, d, slack);
    case Convex::Core::box:
      return box_face(c, d, slack);
    case Convex::Core::cylinder:
    case Convex::Core::cone:
      return revolved(c, d, slack);
    case Convex::Core::sector:
      return sector_feature(c, d, slack);
    case Convex::Core::polyhedron: {
      const uint32_t v = support_vertex(*c.polyhedron, d, 0);
      SupportingFeature f = polyhedron_face(*c.polyhedron, d, slack, v);
      f.vertex = v;
      return f;
    }
    default:
      return core_edge(c, d, slack, Vec3::Zero());
  }
}

/// Finds a feature of a solid with a place by find(solid), in the frame of its core.
template <class Find>
SupportingFeature from_core(const Convex& c, Find&& find) {
  Convex own = c;
  own.place = nullptr;
  SupportingFeature f = find(own);
  f.place(c.place->orientation.toRotationMatrix(), c.place->position);
  return f;
}

}  // namespace

void SupportingFeature::place(const Mat3& rotation, const Vec3& translation) {
  for (uint32_t k = 0; k < count; ++k) corners[k].point = rotation * corners[k].point + translation;
  normal = rotation * normal;
  on_face = rotation * on_face + translation;
  edge = rotation * edge;
}

SupportingFeature supporting_feature(const Convex& c, const Vec3& d, Real slack) {
  if (!c.place) return core_feature(c, d, slack);
  return from_core(c,
                   [&](const Convex& own) { return core_feature(own, c.place->vector_to_body(d), slack); });
}

SupportingFeature supporting_edge(const Convex& c, const Vec3& d, Real slack, const Vec3& on_surface) {
  if (!c.place) return core_edge(c, d, slack, on_surface);
  return from_core(c, [&](const Convex& own) {
    return core_edge(own, c.place->vector_to_body(d), slack, c.place->point_to_body(on_surface));
  });
}

}  // namespace offstage::sim
