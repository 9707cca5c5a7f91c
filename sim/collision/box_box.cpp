#include "sim/collision/box_box.h"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "sim/collision/contact_candidates.h"
#include "sim/linear/lanes.h"

namespace offstage::sim {
namespace {

/// If the sine of the angle between two edges is below this, their cross product is not used as an axis. The
/// resulting error is at most this fraction of the edges' length.
constexpr Real kNoAxis = 1e-10;
/// Greatest rounding error of the crossing of two edges, or of the gap along their common perpendicular, as a
/// fraction of the sizes.
constexpr Real kCrossingRounding = 1e-12;

/// One box in the frame of the other.
struct Placed {
  Mat3 rotation;
  Vec3 translation;
  Placed inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

// Axes

/// Gap between the boxes along each axis; negative where they overlap.
struct Gaps {
  Lanes a, b;  ///< gaps along the axes of A and of B
  /// Gaps along the cross products of A's axes with B's, times the sine of the angle between the axes.
  std::array<Lanes, 3> products;

  Gaps(const Vec3& half_a, const Vec3& half_b, const Placed& at) {
    const LaneColumns r = columns(at.rotation), s = lane_abs(r);
    const Lanes half = lanes(half_a), t = lanes(at.translation);
    a = lane_abs(t) - half - product(s, half_b);
    b = lane_abs(product(transposed(r), t)) - lanes(half_b) - product(transposed(s), half_a);
    const auto along = [&](Lanes column, Lanes spread, Lanes extent_b) {
      return lane_abs(lane_last(t) * lane_next(column) - lane_next(t) * lane_last(column)) -
             (lane_next(half) * lane_last(spread) + lane_last(half) * lane_next(spread)) - extent_b;
    };
    products = {along(r.x, s.x, half_b[1] * s.z + half_b[2] * s.y),
                along(r.y, s.y, half_b[2] * s.x + half_b[0] * s.z),
                along(r.z, s.z, half_b[0] * s.y + half_b[1] * s.x)};
  }
  bool exceed(Real margin) const {
    const Lanes most = lane_max(lane_max(a, b), lane_max(lane_max(products[0], products[1]), products[2]));
    return std::max({most[0], most[1], most[2]}) > margin;
  }
};

int largest(Lanes x) {
  const int best = x[1] > x[0] ? 1 : 0;
  return x[2] > x[best] ? 2 : best;
}

/// The axis of the largest gap. It is the product of two edges or, if `edges` is false, the normal of a face.
struct Axis {
  Real gap;
  bool edges;
  int a, b;
};

/// Takes the product of two axes if the normalized gap along it is the largest so far. It must exceed the gap
/// of a face by more than rounding: an edge that lies on a face gives, with every edge of that face, the
/// face's own normal.
void try_products(const Gaps& gaps, const Mat3& rotation, Real rounding, Axis& best) {
  Real least = best.gap + rounding;
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) {
      const Real scaled = gaps.products[static_cast<std::size_t>(b)][a];
      if (scaled <= 0 && scaled <= least) continue;  // normalizing it only makes it more negative
      const Real next = rotation((a + 1) % 3, b), last = rotation((a + 2) % 3, b);
      const Real sine = std::sqrt(next * next + last * last);
      if (!(sine > kNoAxis && scaled > least * sine)) continue;
      least = scaled / sine;
      best = {least, true, a, b};
    }
}

/// Returns the closest points of two edges if both are inside their edges. Returns nothing if they are not,
/// or if rounding makes this uncertain.
std::optional<Separation> edge_separation(const Convex& a, const Convex& b, const Placed& at,
                                          const Axis& axis, Real rounding) {
  const Vec3 u = Vec3::Unit(axis.a), w = at.rotation.col(axis.b), cross = u.cross(w);
  const Real sine = cross.norm();
  if (sine < kParallel) return std::nullopt;
  Separation s;
  s.normal = (cross.dot(at.translation) > 0 ? -1 : 1) / sine * cross;
  const Vec3 in_b = at.rotation.transpose() * s.normal;
  Vec3 p, q;  // midpoints of the edges
  for (int k = 0; k < 3; ++k) {
    p[k] = k == axis.a ? 0 : std::copysign(a.half[k], -s.normal[k]);
    q[k] = k == axis.b ? 0 : std::copysign(b.half[k], in_b[k]);
  }
  const Vec3 between = p - (at.rotation * q + at.translation);
  s.distance = s.normal.dot(between);
  // The vector between the closest points of the edges is along the normal.
  const Vec3 across_a = s.normal.cross(u), across_b = s.normal.cross(w);
  const Real along_a = -across_b.dot(between) / across_b.dot(u),
             along_b = across_a.dot(between) / across_a.dot(w);
  if (std::abs(s.distance - axis.gap) > rounding || std::abs(along_a) > a.half[axis.a] + rounding ||
      std::abs(along_b) > b.half[axis.b] + rounding)
    return std::nullopt;
  s.on_a = p + along_a * u;
  s.on_b = s.on_a - s.distance * s.normal;
  return s;
}

// Faces

/// A face of a box, perpendicular to `axis`. Its corners are numbered as by Convex::vertex().
struct Face {
  int axis;
  bool positive;

  int axis_of(int k) const { return (axis + 1 + k) % 3; }
  Real sign() const { return positive ? 1 : -1; }
  /// Number of the box's vertex at a corner of the face. Corners are counter-clockwise seen from outside.
  uint32_t tag(uint32_t corner) const {
    const uint32_t at = (positive ? corner : 3 - corner) % 4, right = at == 1 || at == 2, up = at >= 2;
    return uint32_t{positive} << axis | right << axis_of(0) | up << axis_of(1);
  }
};

/// Returns the face with the largest part within `slack` of the plane that touches the box in direction `d`,
/// as supporting_feature() does.
Face facing(const Vec3& half, const Vec3& d, Real slack) {
  Vec3 extent = 2 * half;
  for (int k = 0; k < 3; ++k)
    if (const Real rise = extent[k] * std::abs(d[k]); rise > slack) extent[k] *= slack / rise;
  const Vec3 patch(extent[1] * extent[2] * std::abs(d[0]), extent[2] * extent[0] * std::abs(d[1]),
                   extent[0] * extent[1] * std::abs(d[2]));
  const int axis = largest(lanes(patch));
  return {axis, d[axis] > 0};
}

/// The face that is least inclined to `d`, and the sine of the inclination. If this face cannot give the
/// normal of the contact, the sine is 1, which is more than kMaxTilt (see tilt() in manifold.cpp).
struct Tilted {
  Face face;
  Real sine;
};
Tilted tilted_face(const Vec3& d, Lanes gaps, Real distance, Real tolerance) {
  const int axis = largest(lane_abs(lanes(d)));
  const Real next = d[(axis + 1) % 3], last = d[(axis + 2) % 3], sine = std::sqrt(next * next + last * last);
  const bool serves = std::abs(distance) * sine <= tolerance && distance - gaps[axis] <= tolerance;
  return {{axis, d[axis] > 0}, serves ? sine : 1};
}

/// The incident face, clipped against the sides of the reference face in its plane.
class FaceContact {
 public:
  /// `other` is the face of the incident box that faces the reference face; `at` is its placement in the
  /// reference's frame.
  FaceContact(const Vec3& half, const Face& face, const Face& other, const Vec3& other_half, const Placed& at,
              uint32_t body, Real slop)
      : face_(face), other_(other), body_(body) {
    const int u = face.axis_of(0), v = face.axis_of(1);
    half_ = {half[u], half[v]};
    slop_ = slop;
    const auto flat = [&](const Vec3& x) { return Vec3(x[u], x[v], face.sign() * x[face.axis]); };
    const int j = other.axis_of(0), k = other.axis_of(1);
    const Vec3 middle =
        flat(at.translation + other.sign() * other_half[other.axis] * at.rotation.col(other.axis)) -
        Vec3(0, 0, half[face.axis]);
    const Vec3 right = flat(other_half[j] * at.rotation.col(j)),
               up = flat(other_half[k] * at.rotation.col(k));
    for (uint32_t corner = 0; corner < 4; ++corner) {
      const uint32_t tag = other.tag(corner);
      const Real x = tag >> j & 1 ? 1 : -1, y = tag >> k & 1 ? 1 : -1;
      corners_[corner] = {middle + x * right + y * up, vertex_id(1 - body, tag), corner};
    }
    for (uint32_t side = 0; side < 4 && count_ > 0; ++side) cut(side);
  }

  FaceContact(const FaceContact&) = delete;

  struct Corner {
    Vec3 at;  ///< position along the axes of the reference face, and height over it
    uint32_t id;
    /// The side that starts at the corner: a side of the incident face, or kReference + side of the reference
    /// face.
    uint32_t side;
  };
  uint32_t count() const { return count_; }
  int other_axis() const { return other_.axis; }
  const Corner& corner(uint32_t k) const { return corners_[k]; }
  /// Returns the height of the lowest corner, or infinity if there are no corners.
  Real lowest() const {
    Real least = kInfinity;
    for (uint32_t k = 0; k < count_; ++k) least = std::min(least, corners_[k].at[2]);
    return least;
  }
  /// Returns the mean of the corners.
  Vec3 middle() const {
    Vec3 sum = Vec3::Zero();
    for (uint32_t k = 0; k < count_; ++k) sum += corners_[k].at;
    return sum / std::max(1u, count_);
  }
  /// Whether any corner with at most this height is over the face.
  bool has_corner_over_face(Real height) const {
    for (uint32_t k = 0; k < count_; ++k) {
      const Vec3& p = corners_[k].at;
      if (p[2] <= height && std::abs(p[0]) <= half_[0] && std::abs(p[1]) <= half_[1]) return true;
    }
    return false;
  }

 private:
  static constexpr uint32_t kReference = 4;

  static uint32_t side_id(const Face& f, uint32_t k) { return edge_id(f.tag(k), f.tag(k + 1)); }

  /// Returns the id of a crossing. If both sides are neighbouring sides of the reference face, the crossing
  /// is a vertex of this face.
  uint32_t crossing(uint32_t side, uint32_t cut, uint32_t cut_id) const {
    if (side < kReference) return crossing_id(1 - body_, side_id(other_, side), cut_id);
    return vertex_id(body_, face_.tag((side - kReference + 1) % 4 == cut ? cut : side - kReference));
  }

  /// Cuts at side k of the reference face: sides 0 and 2 bound v, sides 1 and 3 bound u; see Face::tag.
  void cut(uint32_t k) {
    const int along = k % 2 == 0 ? 1 : 0;
    const bool low = face_.positive ? k == 0 || k == 3 : k >= 2;
    const Real sign = low ? -1 : 1, limit = half_[static_cast<std::size_t>(along)] + slop_;
    std::array<Real, kMax> inside;
    Real least = kInfinity;
    for (uint32_t i = 0; i < count_; ++i)
      least = std::min(least, inside[i] = limit - sign * corners_[i].at[along]);
    if (least >= 0) return;
    const Corner* whole = corners_;
    corners_ = buffers_[corners_ == buffers_[0].data()].data();
    const uint32_t count = std::exchange(count_, 0), id = side_id(face_, k);
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t j = i + 1 == count ? 0 : i + 1;
      const Real here = inside[i], there = inside[j];
      if (here >= 0) corners_[count_++] = whole[i];
      if ((here >= 0) == (there >= 0)) continue;
      corners_[count_++] = {whole[i].at + here / (here - there) * (whole[j].at - whole[i].at),
                            crossing(whole[i].side, k, id), here >= 0 ? kReference + k : whole[i].side};
    }
  }

  // A cut adds one corner or, if rounding has made the polygon concave, at most doubles their number.
  static constexpr uint32_t kMax = 4 << 4;

  Face face_, other_;
  uint32_t body_;
  std::array<Real, 2> half_;
  Real slop_;
  uint32_t count_ = 4;
  std::array<std::array<Corner, kMax>, 2> buffers_;
  Corner* corners_ = buffers_[0].data();  ///< one of the two buffers
};

/// The two boxes of a face contact: the reference box, whose face gives the normal, and the incident box.
struct FacePair {
  const Convex &reference, &incident;
  Placed at;  ///< the incident box in the reference's frame
  Face face;
  uint32_t body;  ///< name of the reference box: 0 for A, 1 for B

  FaceContact contact(Real slack, Real slop) const {
    const Vec3 towards = -face.sign() * at.rotation.row(face.axis).transpose();
    return {reference.half, face, facing(incident.half, towards, slack), incident.half, at, body, slop};
  }

  /// Whether the distance of two separate boxes is the `gap` along the normal of the reference face. This
  /// holds if the lowest corner of the incident face lies above the reference face, and not beside it.
  ///
  /// Faces at a small angle may also count. Let a point of the incident box be over the face, `depth` from
  /// its border, and higher by `drop` than the lowest corner, whose height is h. Boxes are convex, so at a
  /// distance x outside the face the height is at least h - x drop / depth. The closest points are therefore
  /// about h apart, along a normal that is inclined by at most drop / depth.
  bool is_distance(Real gap, const FaceContact& contact, Real margin, Real slop, Real rounding) const {
    if (contact.has_corner_over_face(gap + rounding)) return true;
    const Real alike = at.rotation.row(face.axis).transpose().cross(Vec3::Unit(contact.other_axis())).norm();
    const Vec3 middle = contact.middle();
    const Real depth = std::min(reference.half[face.axis_of(0)] - std::abs(middle[0]),
                                reference.half[face.axis_of(1)] - std::abs(middle[1]));
    const Real lowest = contact.lowest(), drop = middle[2] - lowest;
    return alike <= kMaxTilt && drop <= kMaxTilt * depth && depth > slop &&
           lowest + slop <= gap + kTilt * margin;
  }
};

/// Writes the points of the contact. It also writes `closest`, the closest point on the incident box, if that
/// is deeper.
void fill(Manifold& m, const FacePair& pair, const FaceContact& contact, const Pose& a_from_b, Real margin,
          Real slop, const Separation* closest, Manifold* more) {
  const bool on_a = pair.body == 0;
  const int axis = pair.face.axis, u = pair.face.axis_of(0), v = pair.face.axis_of(1);
  const Mat3 rotation = pair.body == 0 ? Mat3::Identity() : a_from_b.orientation.toRotationMatrix();
  const Vec3 n = pair.face.sign() * rotation.col(axis),
             origin = (on_a ? Vec3(Vec3::Zero()) : a_from_b.position) + pair.reference.half[axis] * n;
  m.normal = on_a ? Vec3(-n) : n;
  m.source = on_a ? NormalSource::face_of_a : NormalSource::face_of_b;
  m.edge_a = m.edge_b = Vec3::Zero();
  m.radius_a = m.radius_b = 0;
  Candidates candidates;
  const auto add = [&](const Vec3& on_reference, Real separation, uint32_t id) {
    if (separation > margin) return;
    const Vec3 on_incident = on_reference + separation * n;
    candidates.add(on_a ? Candidate{on_reference, on_incident, separation, id}
                        : Candidate{on_incident, on_reference, separation, id});
  };
  for (uint32_t k = 0; k < contact.count(); ++k) {
    const auto& [at, id, side] = contact.corner(k);
    add(origin + at[0] * rotation.col(u) + at[1] * rotation.col(v), at[2], id);
  }
  if (closest) {
    const Vec3& p = on_a ? closest->on_b : closest->on_a;
    const Real height = n.dot(p - origin);
    if (candidates.count == 0 || height < candidates.least_separation() - slop)
      add(p - height * n, height, closest_id(1 - pair.body));
  }
  reduce(m, candidates, slop, more);
}

}  // namespace

bool box_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin, Manifold& m,
                  MoreManifolds* more) {
  const Placed at{a_from_b.orientation.toRotationMatrix(), a_from_b.position};
  const Gaps gaps(a.half, b.half, at);
  m.count = 0;
  if (gaps.exceed(margin)) return true;

  const Real reach_a = a.half.norm(), reach_b = b.half.norm(), size = reach_a + reach_b;
  const int face_a = largest(gaps.a), face_b = largest(gaps.b);
  Axis axis{std::max(gaps.a[face_a], gaps.b[face_b]), false, face_a, face_b};
  try_products(gaps, at.rotation, kCrossingRounding * size, axis);
  if (axis.gap > margin) return true;
  const std::optional<Separation> edges =
      axis.edges ? edge_separation(a, b, at, axis, kCrossingRounding * size) : std::optional<Separation>();
  const bool by_a = gaps.a[face_a] >= gaps.b[face_b];
  const Vec3 along = by_a ? Vec3(Vec3::Unit(face_a)) : Vec3(at.rotation.col(face_b));
  const Vec3 n = edges ? edges->normal : Vec3((along.dot(at.translation) > 0 ? -1 : 1) * along);

  // The choice is the same as in manifold(): if a face of each box can give the normal, the less inclined
  // face does.
  const Real rounding = kSeparationRounding * size, tolerance = kTilt * margin + rounding,
             slop = kRim * margin + rounding;
  const Tilted of_a = tilted_face(-n, gaps.a, axis.gap, tolerance),
               of_b = tilted_face(at.rotation.transpose() * n, gaps.b, axis.gap, tolerance);
  const bool by_edges = std::min(of_a.sine, of_b.sine) > kMaxTilt;
  if (by_edges) {
    if (!edges) return false;
    m = manifold(a, b, a_from_b, *edges, margin);
    if (!more) return true;
  }
  const Mat3 b_from_a = at.rotation.transpose();
  const bool a_gives = by_edges ? n.cwiseAbs().maxCoeff() >= (b_from_a * n).cwiseAbs().maxCoeff()
                                : a_gives_normal(of_a.sine, of_b.sine, reach_a, reach_b);
  const FacePair pair =
      a_gives ? FacePair{a, b, at, of_a.face, 0} : FacePair{b, a, at.inverse(), of_b.face, 1};
  if (by_edges) {
    const Real cosine = (a_gives ? n : Vec3(b_from_a * n)).cwiseAbs().maxCoeff();
    if (cosine <= kNearFace) return true;
    auto& [near, left_out] = more->manifolds;
    fill(near, pair, pair.contact(margin + rounding, slop), a_from_b, margin, slop, nullptr, &left_out);
    for (Manifold& further : more->manifolds) drop_below(further, std::min(0.0, axis.gap) + slop);
    return true;
  }
  const Real gap = pair.body == 0 ? gaps.a[pair.face.axis] : gaps.b[pair.face.axis];
  const FaceContact contact = pair.contact(margin + rounding, slop);
  const bool is_known = edges || axis.gap <= 0;
  if (!is_known && !pair.is_distance(gap, contact, margin, slop, rounding)) return false;
  fill(m, pair, contact, a_from_b, margin, slop, edges ? &*edges : nullptr,
       more ? &more->manifolds[0] : nullptr);
  return m.count > 0;
}

}  // namespace offstage::sim
