#include "sim/contact/internal_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "sim/collision/contact_candidates.h"
#include "sim/collision/distance.h"
#include "sim/collision/gjk.h"
#include "sim/core/parallel_loop.h"
#include "sim/core/rotation.h"
#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

/// Two normals count as equal if the cosine of the angle between them is greater than this.
constexpr Real kSameDirection = 1 - 1e-10;
/// Clipping may put points outside of their surface, by up to this fraction of the body's extent, and by up
/// to kRim times the margin of the search.
constexpr Real kClipped = 2e-3;
/// Cosines. A surface continues a face if the angle between both normals has a cosine of at least kGoesOn. A
/// contact pushes along the surface's own normal if the cosine is at least kOwnNormal.
constexpr Real kGoesOn = 0.999, kOwnNormal = 0.9;
/// Height over a face at which the surface next to it is sampled, as a multiple of the greatest flush step.
constexpr Real kLookOver = 3;
/// If a body has more contacts than this, they are not compared with each other.
constexpr std::size_t kMostContacts = 512;
/// Lateral distance at which the surface is sampled, as a multiple of the greatest flush step. With
/// kLookOver, the direction from an edge to the sample is at 18 degrees to the normal.
constexpr Real kLookBeside = 1;
/// Greatest overlap that counts as prevented [m].
constexpr Real kPrevented = 2e-4;
/// Contacts with a slope are searched within this distance beyond the contact that they replace [m].
constexpr Real kSlopeMargin = 2e-3;

/// Returns the distance of a point from a convex piece of a shape, with its gradient, in the shape's frame.
SurfaceDistance piece_distance(const CollisionShape& shape, uint32_t piece, const Vec3& p) {
  if (shape.is_plane()) return {p.y(), Vec3::UnitY()};
  if (!shape.solid().mesh) return signed_distance(shape.solid(), p);
  const Convex convex = shape.piece(piece);
  if (convex.core == Convex::Core::triangle) {
    const Vec3 away =
        p - closest_on_triangle(p, *convex.corners[0], *convex.corners[1], *convex.corners[2]).point;
    const Real distance = away.norm();
    if (distance > 0) return {distance, away / distance};
    return {0, shape.solid().mesh->topology.face_normal(piece)};
  }
  if (convex.core != Convex::Core::polyhedron) {
    GjkCache fresh;
    const Separation s = gjk(Convex{}, convex, {-p, Quat::Identity()}, fresh);
    return {s.distance, s.normal};
  }
  const ConvexPolyhedron& polyhedron = *convex.polyhedron;
  SurfaceDistance inside{-std::numeric_limits<Real>::infinity(), Vec3::UnitY()};
  for (uint32_t f = 0; f < polyhedron.face_count(); ++f) {
    const ConvexPolyhedron::Plane& plane = polyhedron.plane(f);
    if (const Real d = plane.normal.dot(p) - plane.offset; d > inside.distance) inside = {d, plane.normal};
  }
  if (inside.distance <= 0) return inside;
  GjkCache fresh;
  const Separation s = gjk(Convex{}, convex, {-p, Quat::Identity()}, fresh);
  return {s.distance, s.normal};
}

/// The start and the end of an interval.
constexpr bool kBothEnds[] = {false, true};

/// Returns the first piece of the ring to which a piece belongs; the piece itself if it is no part of a ring.
uint32_t first_part_of_ring(Body& body, uint32_t piece) {
  const CollisionMesh* mesh = body.solid.mesh;
  return mesh && mesh->round_surface(piece) ? mesh->first_part_of_solid_of(piece) : piece;
}

/// A manifold seen from body X, one of its two bodies, if X also has other manifolds. Y is the other body.
/// The view stores the data for comparing it with the other views of X.
struct View {
  View(ContactPair& of, uint32_t i, bool is_speculative, const Manifold& manifold, bool x_is_first)
      : pair(&of),
        m(&manifold),
        index(i),
        x_part(x_is_first ? m->piece_a : m->piece_b),
        x_piece(first_part_of_ring(x_is_first ? of.a() : of.b(), x_part)),
        y_piece(x_is_first ? m->piece_b : m->piece_a),
        x_is_a(x_is_first),
        speculative(is_speculative),
        normal(x_is_first ? m->normal : Vec3(-m->normal)) {
    for (uint32_t k = 1; k < m->count; ++k)
      if (m->points[k].separation < m->points[deepest].separation) deepest = k;
  }

  ContactPair* pair;
  const Manifold* m;
  /// x_part: piece of X. x_piece: the same for all sectors of a ring, over which a contact rolls.
  uint32_t index, x_part, x_piece, y_piece, deepest = 0;
  bool x_is_a, speculative;
  Vec3 normal;  ///< towards X

  Body& x() const { return x_is_a ? pair->a() : pair->b(); }
  Body& y() const { return x_is_a ? pair->b() : pair->a(); }
  const Vec3& on_y(uint32_t k) const { return x_is_a ? m->points[k].on_b : m->points[k].on_a; }
  const Vec3& on_x(uint32_t k) const { return x_is_a ? m->points[k].on_a : m->points[k].on_b; }
  Real separation() const { return m->points[deepest].separation; }
  /// Returns the piece of Y at point k.
  uint32_t piece_at(uint32_t k) const {
    return y().collision_shape().is_plane() || !y().collision_shape().surface() ? y_piece
                                                                                : m->points[k].piece;
  }
  bool continues() const { return x_is_a ? m->continues_b : m->continues_a; }
  bool is_face() const { return m->source == (x_is_a ? NormalSource::face_of_b : NormalSource::face_of_a); }
  /// Whether a face of X gives the normal.
  bool is_face_of_x() const {
    return m->source == (x_is_a ? NormalSource::face_of_a : NormalSource::face_of_b);
  }
  /// Whether the contact touches along a line or at a point, as a contact at an internal edge does.
  bool may_be_at_internal_edge() const {
    if (continues() || y().collision_shape().is_plane()) return false;
    // If a face of X that gives the normal is inclined over a face of Y, only an edge or a corner of Y may
    // touch it.
    if (!is_narrow(is_face_of_x() ? near_deepest(*m) : *m)) return false;
    return !is_face() || !std::holds_alternative<Sphere>(x().def.shape);
  }
};

/// The decision on a contact: it is removed, or another manifold replaces it.
struct Verdict {
  ContactPair* pair;
  uint32_t index;
  Manifold instead;
};

/// The contacts of one body X at one time.
class BodyContacts {
 public:
  /// `is_decided(pair, i)`: whether there is a verdict on the i-th contact of a pair. It is left out then.
  BodyContacts(const Body& x, std::span<ContactPair* const> pairs, const auto& is_decided, Real time, Real h)
      : x_(x), time_(time), h_(h) {
    for (ContactPair* pair : pairs) {
      const std::vector<PlacedManifold>& all = pair->manifolds();
      const std::size_t found = all.size() - pair->speculative;
      for (uint32_t i = 0; i < all.size(); ++i)
        if (!is_decided(pair, i))
          views_.emplace_back(*pair, i, i >= found, i >= found ? pair->at_end(i - found) : all[i].manifold,
                              &pair->a() == &x);
    }
    flush_ = std::min(kFlush, kFlushFraction * x.extent);
    for (const View& v : views_)
      if (!v.speculative && v.is_face() && v.separation() <= flush_) faces_.push_back(&v);
  }

  std::vector<Verdict> judge() {
    std::vector<Verdict> verdicts;
    if (views_.size() > kMostContacts) return verdicts;
    drop_faces_at_internal_edges();
    struct Hidden {
      std::size_t contact, by;
      Vec3 normal;  // normal of the surface at the contact
    };
    std::vector<Hidden> hidden;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (views_[i].speculative && (is_predicted(views_[i]) || is_prevented(views_[i]))) {
        verdicts.push_back({views_[i].pair, views_[i].index, {}});
        continue;
      }
      const auto face = std::find_if(faces_.begin(), faces_.end(),
                                     [&](const View* f) { return keeps_apart(*f, views_[i]); });
      if (face != faces_.end()) {
        verdicts.push_back({views_[i].pair, views_[i].index, {}});
        if (!views_[i].speculative) verdicts.back().instead = upright(views_[i], **face);
        continue;
      }
      if (std::ranges::any_of(faces_, [&](const View* f) { return passes_over(*f, views_[i]); })) {
        verdicts.push_back({views_[i].pair, views_[i].index, {}});
        continue;
      }
      if (!views_[i].may_be_at_internal_edge()) continue;
      for (std::size_t k = 0; k < views_.size(); ++k)
        if (k != i && !views_[k].speculative)
          if (const auto normal = normal_instead(views_[i], views_[k])) hidden.push_back({i, k, *normal});
    }
    const auto is_hidden = [&](std::size_t i) {
      return std::any_of(hidden.begin(), hidden.end(), [&](const Hidden& x) { return x.contact == i; });
    };
    std::size_t last = views_.size();
    for (const auto& [contact, by, normal] : hidden) {
      // If each of two contacts hides the other, both are kept.
      if (contact == last || is_hidden(by)) continue;
      last = contact;
      const View& v = views_[contact];
      verdicts.push_back({v.pair, v.index, {}});
      if (normal != views_[by].normal && !v.speculative)
        verdicts.back().instead = on_slope(v, views_[by], normal);
    }
    return verdicts;
  }

 private:
  Pose pose(const Body& body, bool at_end) const { return at_end ? body.pose : body.placed_at(time_, h_); }

  static Vec3 middle(const View& v) {
    Vec3 sum = Vec3::Zero();
    for (uint32_t k = 0; k < v.m->count; ++k) sum += v.on_y(k);
    return sum / v.m->count;
  }

  /// Returns the point of a contact that is highest in the direction `up`.
  static Vec3 highest(const View& v, const Vec3& up) {
    Vec3 best = v.on_y(0);
    for (uint32_t k = 1; k < v.m->count; ++k)
      if (up.dot(v.on_y(k) - best) > 0) best = v.on_y(k);
    return best;
  }

  /// Whether the known points of X on flush surfaces predict all points of a speculative contact. This is so
  /// if X moves on from one tile to the next: the force at the first tile also holds X over the second one.
  bool is_predicted(const View& v) const {
    for (uint32_t k = 0; k < v.m->count; ++k)
      if (std::none_of(views_.begin(), views_.end(),
                       [&](const View& known) { return !known.speculative && predicts(known, v, k); }))
        return false;
    return true;
  }

  /// Whether a face on which X lies prevents the overlap of a speculative contact. The free motion leads X
  /// into the face, too, and the face lifts it out of that overlap. A wheel that rolls on to the next tile,
  /// for example, seems to sink at the edge of the tile that it leaves. Dynamic bodies are left out, since
  /// they may yield instead of lifting X.
  bool is_prevented(const View& v) const {
    if (v.y().is_dynamic()) return false;
    return std::any_of(faces_.begin(), faces_.end(), [&](const View* face) {
      if (face->x_piece != v.x_piece || face->y().is_dynamic()) return false;
      const PlacedManifold& m = face->pair->manifolds()[face->index];
      Real lift = std::numeric_limits<Real>::infinity();
      for (uint32_t k = 0; k < m.manifold.count; ++k)
        lift = std::min(lift, -face->pair->separation_at_end(m, m.manifold.points[k], h_ - time_));
      return v.separation() + std::max(0.0, lift) * face->normal.dot(v.normal) > -kPrevented;
    });
  }

  bool predicts(const View& known, const View& v, uint32_t k) const {
    const Vec3 up = known.normal;
    if (known.x_piece != v.x_piece || v.normal.dot(up) < kGoesOn) return false;
    const Body& y = known.y();
    const Vec3 at_end = pose(y, true).point_to_world(pose(y, false).point_to_body(known.on_y(known.deepest)));
    if (up.dot(v.on_y(k) - at_end) > flush_) return false;
    // At the end, other tiles divide the line on which X lies.
    const bool between = known.pair != v.pair || is_round_about_axis(x_.def.shape) || has_revolved_part(x_);
    ContactPoint point = v.m->points[k];
    if (known.x_is_a != v.x_is_a) std::swap(point.on_a, point.on_b);
    return known.pair->predicts(known.pair->manifolds()[known.index],
                                known.x_is_a ? v.normal : Vec3(-v.normal), point, h_ - time_, between);
  }

  /// Returns the point of a piece that is farthest in the direction d.
  static Vec3 farthest(Body& body, uint32_t piece, const Pose& at, const Vec3& d) {
    const Convex convex = body.collision_shape().piece(piece);
    const Vec3 local = at.vector_to_body(d);
    uint32_t vertex = 0;
    return at.point_to_world(convex.support(local, vertex) + convex.radius * local);
  }

  /// Whether X turns into a contact next to a face on which it lies, for example a box that tips over an edge
  /// of the face. Then both the contact and the lowest point of X approach faster than the point on the face.
  /// If X slides, rolls or lands, its lowest point does not.
  bool tips_into(const View& v, const View& face) const {
    const Vec3 up = face.normal;
    const auto speed = [&](const View& to, const Vec3& place) {
      return (to.x_is_a ? 1 : -1) * up.dot(to.pair->relative_velocity(place));
    };
    const Real tips = speed(face, face.on_y(face.deepest)) - flush_ / (h_ - time_);
    return speed(v, v.on_y(v.deepest)) < tips &&
           speed(v, farthest(v.x(), v.x_part, pose(x_, false), -up)) < tips;
  }

  /// Returns a new normal for a contact at or below the level of a face on which the same piece of X lies. It
  /// is needed if the surface at the contact, seen from above the face, does not have the contact's normal.
  /// It is the surface's own normal, or the normal of the face if the surface only continues the face.
  std::optional<Vec3> normal_instead(const View& v, const View& face) const {
    const Vec3 n = v.normal, up = face.normal;
    if (v.x_piece != face.x_piece || n.dot(up) > kSameDirection) return std::nullopt;
    // Two convex pieces have no internal edge between them: all their contacts are valid.
    if (v.pair == face.pair && v.y_piece == face.y_piece) return std::nullopt;
    const Vec3& on_face = face.on_y(face.deepest);
    const Real clipped = std::max(kClipped * x_.extent, kRim * v.pair->margin());
    Real low = std::min(0.0, face.separation()) - flush_ - clipped;
    const Real moved = v.speculative ? std::abs(up.dot(x_.pose.position - x_.start_pose.position)) : 0;
    low -= moved;
    // A surface that is flush with a face is not nearer to X than the face. So a nearer contact is not with a
    // flush surface.
    if (v.separation() < face.separation() - flush_ - clipped - moved) return std::nullopt;
    for (uint32_t k = 0; k < v.m->count; ++k)
      if (const Real height = up.dot(v.on_y(k) - on_face); height < low || height > flush_ + clipped)
        return std::nullopt;
    if (tips_into(v, face)) return std::nullopt;
    Vec3 top = on_surface(v, 0);
    uint32_t top_piece = v.piece_at(0);
    for (uint32_t k = 0; k < v.m->count; ++k) {
      const Vec3 place = on_surface(v, k);
      if (const Real height = up.dot(place - on_face); height < low || height > flush_) return std::nullopt;
      if (up.dot(place - top) > 0) top = place, top_piece = v.piece_at(k);
    }
    const Vec3 over = kLookOver * flush_ * up;
    const Vec3 across = (n - n.dot(up) * up).normalized(), over_face = middle(face) + over;
    if (distance(face, over_face).normal.dot(up) < kGoesOn) return std::nullopt;
    if (!face.is_face() &&
        !(is_flat(face, over_face, up, across) && is_flat(face, over_face, up, up.cross(across))))
      return std::nullopt;
    const Vec3 over_top = top + std::max(0.0, up.dot(on_face - top)) * up + over;
    const Vec3 own = distance(v, top_piece, over_top).normal;
    if (own.dot(n) > kSameDirection) return std::nullopt;
    if (own.dot(up) > kGoesOn) return up;
    const bool is_slope = own.dot(up) > 0 && own.dot(n) > 0 && own.dot(n) < kOwnNormal;
    return is_slope && is_ramp(v, top, up, across) ? std::optional(own) : std::nullopt;
  }

  /// Whether a piece of X that lies on a face keeps another piece of X away from a piece of Y. This holds if,
  /// throughout the interval, the other piece of X is nowhere lower than the point that lies on the face, and
  /// Y's piece is nowhere above the plane of the face.
  bool keeps_apart(const View& face, const View& v) const {
    if (face.x_piece == v.x_piece || v.normal.dot(face.normal) > kGoesOn ||
        v.y().collision_shape().is_plane())
      return false;
    return face.normal.dot(v.on_x(0) - face.on_y(face.deepest)) >= -flush_ && separates(face, v);
  }

  /// Whether a piece of X that lies on a face passes over a piece of Y, which it does not touch yet. The
  /// linearised contact with an edge in front of X, slightly below the face, would stop X before it is there.
  bool passes_over(const View& face, const View& v) const {
    if (face.y().is_dynamic() || v.y().is_dynamic()) return false;  // they may yield
    if (face.x_piece != v.x_piece || (v.pair == face.pair && v.y_piece == face.y_piece)) return false;
    if (v.normal.dot(face.normal) > kOwnNormal || v.y().collision_shape().is_plane()) return false;
    return (v.speculative || v.separation() > 0) && separates(face, v);
  }

  /// Whether the plane of a face on which X lies separates the two pieces of a contact throughout the
  /// interval.
  bool separates(const View& face, const View& v) const {
    const uint32_t deepest = face.deepest;
    const Vec3 up = pose(face.y(), false).vector_to_body(face.normal),
               on_face = pose(face.y(), false).point_to_body(face.on_y(deepest)),
               lying = pose(x_, false).point_to_body(face.on_x(deepest));
    return std::all_of(std::begin(kBothEnds), std::end(kBothEnds), [&](bool at_end) {
      const Pose below = pose(face.y(), at_end), x = pose(x_, at_end), y = pose(v.y(), at_end);
      const Vec3 n = below.vector_to_world(up);
      return n.dot(farthest(v.y(), v.y_piece, y, n) - below.point_to_world(on_face)) <= flush_ &&
             n.dot(farthest(v.x(), v.x_part, x, -n) - x.point_to_world(lying)) >= -flush_;
    });
  }

  /// Drops faces on which X does not lie because of another face. For example, the side of a part may be in
  /// the plane of a seam, so that it touches the side of a tile along an edge. Contacts of other parts at
  /// this seam must not get the normal of that side. If each of two faces excludes the other one, both
  /// remain.
  void drop_faces_at_internal_edges() {
    const auto excludes = [&](const View& face, const View& v) {
      return keeps_apart(face, v) || (v.may_be_at_internal_edge() && normal_instead(v, face));
    };
    const std::vector<const View*> all = faces_;
    std::erase_if(faces_, [&](const View* f) {
      return std::any_of(all.begin(), all.end(),
                         [&](const View* g) { return g != f && excludes(*g, *f) && !excludes(*f, *g); });
    });
  }

  /// Returns a contact's manifold with a new normal and without its points. The new normal points towards X
  /// and is fixed in Y.
  static Manifold without_points(const View& v, const Vec3& normal) {
    Manifold m = *v.m;
    m.normal = v.x_is_a ? normal : Vec3(-normal);
    m.source = v.x_is_a ? NormalSource::face_of_b : NormalSource::face_of_a;
    m.edge_a = m.edge_b = Vec3::Zero();
    m.radius_a = m.radius_b = 0;
    m.count = 0;
    return m;
  }

  /// Returns a contact with the normal of the face that keeps its piece away (keeps_apart()). The contact
  /// still holds a leg that stands on the edge of an object as high as the face. Points below the face are
  /// left out.
  Manifold upright(const View& v, const View& face) const {
    const Vec3 up = face.normal;
    Manifold m = without_points(v, up);
    for (uint32_t k = 0; k < v.m->count; ++k) {
      const Real height = up.dot(v.on_y(k) - face.on_y(face.deepest));
      if (height < -flush_) continue;
      ContactPoint point = v.m->points[k];
      point.separation = up.dot(v.on_x(k) - v.on_y(k)) + std::max(0.0, height);
      (v.x_is_a ? point.on_b : point.on_a) = v.on_x(k) - point.separation * up;
      m.points[m.count++] = point;
      if (point.separation < m.points[0].separation) std::swap(m.points[0], m.points[m.count - 1]);
    }
    return m;
  }

  /// Whether a contact is at the foot of a slope: Y is part of the ground, or lies on a face of its own as a
  /// wedge does. In a heap a box may stand with an edge on another one. That is no slope, and it would change
  /// from step to step.
  bool is_ramp(const View& v, const Vec3& foot, const Vec3& up, const Vec3& across) const {
    if (!v.y().is_dynamic()) return true;
    const Real look = kLookOver * flush_;
    return distance(v, foot - look * up - 2 * look * across).normal.dot(up) < -kGoesOn;
  }

  /// Returns point k of a contact, moved to the surface of Y's piece, because clipping can put it slightly
  /// outside.
  Vec3 on_surface(const View& v, uint32_t k) const {
    const SurfaceDistance off = distance(v, v.piece_at(k), v.on_y(k));
    return v.on_y(k) - std::max(0.0, off.distance) * off.normal;
  }

  /// Returns the distance of a place in the world from a piece of Y; by default it is the piece of the
  /// contact.
  SurfaceDistance distance(const View& v, const Vec3& place) const { return distance(v, v.y_piece, place); }
  SurfaceDistance distance(const View& v, uint32_t piece, const Vec3& place) const {
    const Pose y = pose(v.y(), v.speculative);
    SurfaceDistance d = piece_distance(v.y().collision_shape(), piece, y.point_to_body(place));
    d.normal = y.vector_to_world(d.normal);
    return d;
  }
  /// Whether Y's surface below a place is a face with the normal `up`, at least on one side along a
  /// direction. Above a convex edge or a corner the nearest point of Y lies directly below for many
  /// directions of `up`. So the nearest point alone does not prove a face.
  bool is_flat(const View& v, const Vec3& over, const Vec3& up, const Vec3& along) const {
    const CollisionShape& shape = v.y().collision_shape();
    const bool is_triangle =
        !shape.is_plane() && shape.solid().mesh && shape.piece(v.y_piece).core == Convex::Core::triangle;
    if (is_triangle) return true;  // its neighbours continue it
    const Vec3 aside = kLookBeside * flush_ * along;
    return distance(v, over - aside).normal.dot(up) > kGoesOn ||
           distance(v, over + aside).normal.dot(up) > kGoesOn;
  }

  /// Returns the contact of X's piece with the slope that begins at the contact `v`.
  Manifold on_slope(const View& v, const View& face, const Vec3& normal) const {
    const Pose plane{highest(v, face.normal), rotation_between(Vec3::UnitY(), normal)};
    const Pose x = pose(v.x(), false), y = pose(v.y(), false);
    const Pose plane_from_x{plane.point_to_body(x.position), plane.orientation.conjugate() * x.orientation};
    const Real margin = std::max(0.0, v.separation()) + kSlopeMargin;
    const Manifold on_plane =
        placed(plane_manifold(v.x().collision_shape().piece(v.x_part), plane_from_x, margin), plane);
    Manifold m = without_points(v, normal);
    // The piece stands on the face and not in the slope. If it is deeper in the slope than `least`, the slope
    // is not a slope but the corner of a flush object.
    const Real least = std::min({0.0, v.separation(), face.separation()}) - flush_;
    const auto add = [&](const ContactPoint& p) {
      const auto& [on_a, on_b] = v.x_is_a ? std::tie(p.on_a, p.on_b) : std::tie(p.on_b, p.on_a);
      m.points[m.count++] = {on_a, on_b, p.separation, p.id, v.y_piece};
    };
    for (uint32_t k = 0; k < on_plane.count; ++k) {
      const ContactPoint& p = on_plane.points[k];
      if (p.separation < least) return {};
      if (piece_distance(v.y().collision_shape(), v.y_piece, y.point_to_body(p.on_b)).distance <= margin)
        add(p);
    }
    if (m.count > 0) return m;
    // A narrow slope, such as the side of a cone, ends before the corners of X. Then X touches it where it
    // begins.
    for (uint32_t k = 0; k < v.m->count; ++k) {
      const Real separation = normal.dot(v.on_x(k) - plane.position);
      if (separation < least) return {};
      add({v.on_x(k), v.on_x(k) - separation * normal, separation, v.m->points[k].id});
    }
    return m;
  }

  const Body& x_;
  Real time_, h_, flush_;
  std::vector<View> views_;
  std::vector<const View*> faces_;  // contacts of Y on whose faces X lies
};

/// The pairs of one body.
struct Group {
  Body* x;
  std::vector<ContactPair*> pairs;
};

struct BodyGroups {
  std::vector<Group> movable;    ///< in the order of the bodies' slots
  std::vector<Group> immovable;  ///< each has one pair, with a body of several pieces
};

/// Returns a group for each movable body that has a contact that may be at an internal edge, and one for each
/// pair of an immovable body with a body of several pieces.
BodyGroups groups_with_internal_edges(std::span<ContactPair* const> pairs) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  BodyGroups groups;
  std::vector<std::size_t> group_of;  // by slot
  std::vector<Body*> bodies;
  for (ContactPair* pair : pairs)
    for (const Body* x : {&pair->a(), &pair->b()})
      if (x->handle.index >= group_of.size()) group_of.resize(x->handle.index + 1, kNone);
  for (ContactPair* pair : pairs) {
    if (!pair->has_narrow()) continue;
    for (const auto& [x, y] : {std::pair(&pair->a(), &pair->b()), std::pair(&pair->b(), &pair->a())}) {
      if (x->is_awake() || x->is_kinematic()) {
        if (group_of[x->handle.index] == kNone) bodies.push_back(x);
        group_of[x->handle.index] = 0;  // numbered below
      } else if (y->collision_shape().piece_count() > 1) {
        groups.immovable.push_back({x, {pair}});
      }
    }
  }
  std::sort(bodies.begin(), bodies.end(), [](Body* a, Body* b) { return a->handle.index < b->handle.index; });
  for (Body* x : bodies) {
    group_of[x->handle.index] = groups.movable.size();
    groups.movable.push_back({x, {}});
  }
  for (ContactPair* pair : pairs) {
    if (pair->manifolds().empty()) continue;
    for (const Body* x : {&pair->a(), &pair->b()})
      if (const std::size_t g = group_of[x->handle.index]; g != kNone)
        groups.movable[g].pairs.push_back(pair);
  }
  return groups;
}

}  // namespace

std::vector<ContactPair*> remove_internal_edge_contacts(std::span<ContactPair* const> pairs, Real time,
                                                        Real h) {
  const bool none = std::none_of(pairs.begin(), pairs.end(), [](ContactPair* p) { return p->has_narrow(); });
  if (none) return {};
  const BodyGroups groups = groups_with_internal_edges(pairs);
  std::vector<std::pair<ContactPair*, uint32_t>> decided;
  const auto is_decided = [&](ContactPair* pair, uint32_t i) {
    return std::binary_search(decided.begin(), decided.end(), std::pair(pair, i));
  };
  std::vector<Verdict> verdicts;
  // A movable body lies on several bodies, and an immovable one is seen with one other body alone. A contact
  // that is at an internal edge for the movable body is therefore left out for the immovable one: it must not
  // serve as a face that hides other contacts.
  for (const std::vector<Group>* bodies : {&groups.movable, &groups.immovable}) {
    std::vector<std::vector<Verdict>> of(bodies->size());
    for_each_index(of.size(), [&](std::size_t i) {
      const Group& group = (*bodies)[i];
      of[i] = BodyContacts(*group.x, group.pairs, is_decided, time, h).judge();
    });
    for (const std::vector<Verdict>& of_body : of)
      verdicts.insert(verdicts.end(), of_body.begin(), of_body.end());
    for (const Verdict& v : verdicts) decided.emplace_back(v.pair, v.index);
    std::sort(decided.begin(), decided.end());
  }
  std::vector<ContactPair*> changed;
  for (const Verdict& v : verdicts) {
    v.pair->replace(v.index, v.instead);
    changed.push_back(v.pair);
  }
  if (changed.empty()) return changed;
  std::vector<ContactPair*> in_order;
  std::sort(changed.begin(), changed.end());
  for (ContactPair* pair : pairs) {
    if (!std::binary_search(changed.begin(), changed.end(), pair)) continue;
    pair->drop_empty();
    in_order.push_back(pair);
  }
  return in_order;
}

}  // namespace offstage::sim
