#include "sim/collision/narrow_phase.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "sim/collision/box_box.h"
#include "sim/collision/coplanar_manifolds.h"
#include "sim/collision/sphere_manifold.h"
#include "sim/collision/tree_pair.h"
#include "sim/collision/triangle_contact.h"
#include "sim/geometry/closest_points.h"
#include "sim/geometry/intersection.h"

namespace offstage::sim {
namespace {

/// Below this distance of two triangles, the direction between their closest points is not reliable [m].
constexpr Real kLeastTriangleDistance = 1e-9;
/// A PairCache with at most this number of entries is searched linearly.
constexpr std::size_t kFewEntries = 8;
/// Greatest number of triangles, itself included, that are searched for the side of a triangle: a few rings
/// around a strip such as a riser.
constexpr std::size_t kMostSearched = 12;
constexpr uint32_t kNoEntry = ~0u;

Pose inverse(const Pose& p) {
  const Quat back = p.orientation.conjugate();
  return {back * -p.position, back};
}

Placement placement(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, Real margin) {
  return {a_from_b, a.reach() + b.reach(), margin};
}

Separation measure(const Convex& a, const Convex& b, const Pose& a_from_b, DistanceMethod method,
                   PairCache::Entry& entry) {
  const bool polyhedra = a.polyhedron && b.polyhedron && a.radius == 0 && b.radius == 0;
  if (method == DistanceMethod::vclip && polyhedra)
    return vclip(*a.polyhedron, *b.polyhedron, a_from_b, entry.vclip);
  return gjk(a, b, a_from_b, entry.gjk);
}

TriangleVertices vertices_of(const Convex& triangle) {
  return {*triangle.corners[0], *triangle.corners[1], *triangle.corners[2]};
}

/// Whether two pieces are tested as triangles.
bool are_triangles(const CollisionShape& a, const CollisionShape& b) {
  return a.is_by_triangles() && b.is_by_triangles();
}

/// Returns the vertices of the triangle `t` transformed by a pose.
TriangleVertices placed_vertices(const Convex& t, const Pose& pose) {
  TriangleVertices v = vertices_of(t);
  for (Vec3& p : v) p = pose.point_to_world(p);
  return v;
}

/// Returns the separation of two triangles from their closest points (2.4, appendix A). If they intersect,
/// GJK computes the depth.
Separation measure_triangles(const Convex& a, const Convex& b, const Pose& a_from_b,
                             PairCache::Entry& entry) {
  const ClosestPoints closest = closest_on_triangles(vertices_of(a), placed_vertices(b, a_from_b));
  const Real distance = std::sqrt(closest.squared_distance);
  if (!(distance > kLeastTriangleDistance)) return gjk(a, b, a_from_b, entry.gjk);
  Separation s;
  s.distance = distance;
  s.normal = (closest.on_a - closest.on_b) / distance;
  s.on_a = closest.on_a;
  s.on_b = closest.on_b;
  s.iterations = 1;
  return s;
}

Separation measure(const CollisionShape& a, uint32_t i, const CollisionShape& b, uint32_t j,
                   const Pose& a_from_b, DistanceMethod method, PairCache::Entry& entry) {
  if (are_triangles(a, b)) return measure_triangles(a.piece(i), b.piece(j), a_from_b, entry);
  return measure(a.piece(i), b.piece(j), a_from_b, method, entry);
}

Separation plane_separation(const Convex& a, const Pose& a_from_plane) {
  Separation s;
  s.normal = a_from_plane.vector_to_world(Vec3::UnitY());
  uint32_t start = 0;
  s.on_a = a.support(-s.normal, start) - a.radius * s.normal;
  s.distance = s.normal.dot(s.on_a - a_from_plane.position);
  s.on_b = s.on_a - s.distance * s.normal;
  return s;
}

/// Returns the side of a triangle on which a piece is that does not show it. It is the previous side if this
/// is known, or else the side known for the triangle that is the fewest edges away, or else that of the sign
/// of `guess`.
template <class SideOfFace>
int unseen_side(const SurfaceTriangle& t, Real guess, int before, SideOfFace&& side_of_face) {
  if (before != 0) return before;
  // The side of each triangle that continues the front of `t`.
  std::array<SurfaceTriangle, kMostSearched> searched = {SurfaceTriangle{t.mesh, t.face, 1}};
  for (std::size_t done = 0, count = 1; done < count; ++done)
    for (std::size_t k = 0; k < 3 && count < kMostSearched; ++k) {
      if (t.mesh->surface.across(searched[done].face)[k] == kNoFace) continue;
      const SurfaceTriangle next = searched[done].neighbour(k);
      const auto end = searched.begin() + static_cast<std::ptrdiff_t>(count);
      if (std::any_of(searched.begin(), end, [&](const SurfaceTriangle& s) { return s.face == next.face; }))
        continue;
      if (const int side = side_of_face(next.face)) return side * next.side;
      searched[count++] = next;
    }
  return guess >= 0 ? 1 : -1;
}

/// Sets the side of a triangle on which the other piece is; initially it is the front. `outward` is the
/// direction from the triangle's nearest point `point` to the piece, and `middle` the piece's centre, in the
/// mesh's frame. Returns the side for the next sub-steps to remember, or 0 if the side is only a guess.
///
/// The direction shows the side if the piece is separate from the triangle and the surface allows a contact
/// in this direction. There are four exceptions. A piece that is beside the triangle and penetrates the
/// surface at another triangle is seen from behind. The foot of a sloping side may come to the border of a
/// sheet from a flush body and be lower by rounding: within kNearBorder, the piece's centre must therefore be
/// on the same side. The centre of a long piece may be below the plane of a triangle whose front the piece
/// approaches from beyond a neighbour. A piece that slides over a surface towards a ridge is exactly behind
/// the triangle beyond the ridge, and in front of the surface; unseen_side() then decides.
template <class SideOfFace>
int set_side(SurfaceTriangle& t, Real distance, const Vec3& outward, const Vec3& point, const Vec3& middle,
             int before, SideOfFace&& side_of_face) {
  constexpr Real kFacing = 0.5, kNearBorder = 1e-4;
  const Vec3 front = t.normal();
  const Real lean = outward.dot(front), height = front.dot(middle - t.corner(0));
  const bool is_beside = distance > 0 && std::abs(lean) <= kAlongside;
  const bool is_clear = (distance > kNearBorder || (distance > 0 && lean * height > 0)) &&
                        !t.runs_along_neighbour(point, outward);
  t.side = lean >= 0 ? 1 : -1;
  if (is_clear && !is_beside && t.allows(point, outward)) return t.side;
  t.side = unseen_side(t, is_clear && !is_beside ? lean : height, before, side_of_face);
  return before != 0 || distance <= 0 || (is_clear && std::abs(lean) > kFacing) ? t.side : 0;
}

/// Whether a contact in the direction `out` from a sector of a ring is at an end of its arc. There the
/// surface continues with the next sector, which is nearer. The end of the arc approaches a floor while the
/// ring rolls or wobbles; the ring does not. If the sine of the ring's lean is below kOutward, the direction
/// around the axis is too inaccurate, and the ring lies on all of its sectors.
bool is_beside_arc(const Convex& c, const Vec3& out) {
  constexpr Real kOutward = 0.02, kSeam = 1e-9;
  if (c.core != Convex::Core::sector) return false;
  const Vec3 d = c.place ? c.place->vector_to_body(out) : out;
  const Real lean2 = d.x() * d.x() + d.z() * d.z();
  return lean2 > kOutward * kOutward && d.x() > 0 && !c.faces_arc(d, kSeam);
}

/// Two pieces of two shapes that are near each other, for which manifolds are computed.
class PiecePair {
 public:
  PiecePair(const CollisionShape& shape_a, uint32_t i, const CollisionShape& shape_b, uint32_t j,
            const Pose& a_from_b, PairCache& cache)
      : shape_a_(shape_a),
        shape_b_(shape_b),
        i_(i),
        j_(j),
        a_from_b_(a_from_b),
        cache_(cache),
        a_(shape_a.piece(i)),
        b_(shape_b.piece(j)) {}

  /// Appends the manifolds, by the fastest method for the cores of the pieces.
  void find(Real margin, DistanceMethod method, bool turning, std::vector<Manifold>& found) {
    const std::size_t before = found.size();
    const CollisionMesh *mesh_a = shape_a_.surface(), *mesh_b = shape_b_.surface();
    if (mesh_b && !mesh_a && a_.core == Convex::Core::point)
      find_sphere({mesh_b, j_}, a_, a_.centre(), a_from_b_, true, margin, found);
    else if (mesh_a && !mesh_b && b_.core == Convex::Core::point)
      find_sphere({mesh_a, i_}, b_, a_from_b_.point_to_world(b_.centre()), Pose{}, false, margin, found);
    else if (mesh_a || mesh_b)
      find_triangles(margin, method, turning, found);
    else
      find_solids(margin, method, turning, found);
    const auto is_beside = [&](const Manifold& m) {
      return is_beside_arc(a_, -m.normal) || is_beside_arc(b_, a_from_b_.vector_to_body(m.normal));
    };
    found.erase(std::remove_if(found.begin() + static_cast<std::ptrdiff_t>(before), found.end(), is_beside),
                found.end());
    for (std::size_t k = before; k < found.size(); ++k) {
      found[k].piece_a = i_;
      found[k].piece_b = j_;
      found[k].continues_a = continues(shape_a_, i_);
      found[k].continues_b = continues(shape_b_, j_);
      for (ContactPoint& p : found[k].points) p.piece = mesh_b ? j_ : i_;
    }
  }

 private:
  /// Whether a piece cannot be at an internal edge. Round surfaces have no internal edges, and neither has a
  /// triangle whose surroundings are all known.
  static bool continues(const CollisionShape& shape, uint32_t piece) {
    if (const CollisionMesh* mesh = shape.surface()) return !mesh->surface.is_at_border(piece);
    return std::holds_alternative<Sphere>(*shape.solid().shape) ||
           std::holds_alternative<Capsule>(*shape.solid().shape) ||
           std::holds_alternative<Ellipsoid>(*shape.solid().shape);
  }

  void find_solids(Real margin, DistanceMethod method, bool turning, std::vector<Manifold>& found) {
    using Core = Convex::Core;
    std::optional<MoreManifolds> more;
    if (turning) more.emplace();
    Manifold& m = found.emplace_back();
    if (is_sphere_pair(a_, b_)) {
      sphere_manifold(a_, Pose{}, b_, a_from_b_, margin, m);
    } else {
      const bool boxes = a_.core == Core::box && b_.core == Core::box && a_.radius == 0 && b_.radius == 0;
      if (!boxes || !box_manifold(a_, b_, a_from_b_, margin, m, more ? &*more : nullptr)) {
        const Separation s = measure(a_, b_, a_from_b_, method, cache_.of(i_, j_));
        if (s.distance <= margin) m = manifold(a_, b_, a_from_b_, s, margin, more ? &*more : nullptr);
      }
    }
    if (m.count == 0) found.pop_back();
    if (!more) return;
    for (const Manifold& extra : more->manifolds)
      if (extra.count > 0) found.push_back(extra);
  }

  int known_side_of_a(uint32_t face) const {
    const PairCache::Entry* e = cache_.find(face, j_);
    return e ? e->side_of_a : 0;
  }
  int known_side_of_b(uint32_t face) const {
    const PairCache::Entry* e = cache_.find(i_, face);
    return e ? e->side_of_b : 0;
  }

  /// Appends the manifold of a sphere and a triangle. `centre` of the sphere and `mesh_pose` are in A's
  /// frame.
  void find_sphere(SurfaceTriangle triangle, const Convex& sphere, const Vec3& centre, const Pose& mesh_pose,
                   bool of_b, Real margin, std::vector<Manifold>& found) {
    if (triangle.mesh->surface.is_sliver(triangle.face)) return;
    const Vec3 p = mesh_pose.point_to_body(centre);
    const TrianglePoint nearest =
        closest_on_triangle(p, triangle.corner(0), triangle.corner(1), triangle.corner(2));
    const Real distance2 = (p - nearest.point).squaredNorm();
    if (distance2 > (sphere.radius + margin) * (sphere.radius + margin)) return;
    const Real height = triangle.normal().dot(p - triangle.corner(0));
    triangle.side = height >= 0 ? 1 : -1;
    if (distance2 < sphere.radius * sphere.radius) {
      const auto known = [&](uint32_t face) { return of_b ? known_side_of_b(face) : known_side_of_a(face); };
      triangle.side = unseen_side(triangle, height, known(triangle.face), known);
      PairCache::Entry& e = cache_.of(i_, j_);
      if (cache_.keeps_sides) (of_b ? e.side_of_b : e.side_of_a) = static_cast<int8_t>(triangle.side);
    }
    Manifold& m = found.emplace_back();
    sphere_triangle_manifold(centre, sphere.radius, triangle, mesh_pose, of_b, margin, m);
    if (m.count == 0) found.pop_back();
  }

  void find_triangles(Real margin, DistanceMethod method, bool turning, std::vector<Manifold>& found) {
    PairTriangles triangles;
    if (shape_a_.surface()) triangles.a.emplace(SurfaceTriangle{shape_a_.surface(), i_});
    if (shape_b_.surface()) triangles.b.emplace(SurfaceTriangle{shape_b_.surface(), j_});
    for (const auto* t : {&triangles.a, &triangles.b})
      if (*t && (*t)->mesh->surface.is_sliver((*t)->face)) return;
    PairCache::Entry& entry = cache_.of(i_, j_);
    const Separation s = measure(a_, b_, a_from_b_, method, entry);
    int known_a = 0, known_b = 0;
    if (triangles.b)
      known_b = set_side(*triangles.b, s.distance, a_from_b_.vector_to_body(s.normal),
                         a_from_b_.point_to_body(s.on_b), a_from_b_.point_to_body(a_.centre()),
                         entry.side_of_b, [&](uint32_t f) { return known_side_of_b(f); });
    if (triangles.a)
      known_a = set_side(*triangles.a, s.distance, -s.normal, s.on_a, a_from_b_.point_to_world(b_.centre()),
                         entry.side_of_a, [&](uint32_t f) { return known_side_of_a(f); });
    if (cache_.keeps_sides) {
      entry.side_of_a = static_cast<int8_t>(known_a);
      entry.side_of_b = static_cast<int8_t>(known_b);
    }
    find_triangle_manifolds(a_, b_, triangles, a_from_b_, s, margin, turning, found);
  }

  const CollisionShape &shape_a_, &shape_b_;
  uint32_t i_, j_;
  const Pose& a_from_b_;
  PairCache& cache_;
  Convex a_, b_;
};

/// The depth of a shape inside a hollow shape whose pieces it does not touch. The inner shape is pushed out
/// in the direction from its centre to the nearest point of the hollow shape's surface. There is no result if
/// the centre is outside.
struct Inside {
  Real depth;
  Vec3 outward, deepest;  // hollow's frame
};
std::optional<Inside> inside(const CollisionShape& hollow, const CollisionShape& other,
                             const Pose& hollow_from_other) {
  if (!hollow.is_hollow() || other.is_plane()) return std::nullopt;
  const Vec3 centre = hollow_from_other.point_to_world(other.hull().centre());
  if (!hollow.box().contains(centre)) return std::nullopt;
  const SurfaceDistance s = signed_distance(*hollow.solid().mesh, centre);
  if (s.distance >= 0) return std::nullopt;
  const Convex& hull = other.hull();
  const Vec3 inward = hollow_from_other.vector_to_body(-s.normal);
  uint32_t start = 0;
  const Vec3 deepest = hollow_from_other.point_to_world(hull.support(inward, start) + hull.radius * inward);
  return Inside{s.normal.dot(centre - deepest) - s.distance, s.normal, deepest};
}

std::optional<Separation> containment(const CollisionShape& a, const CollisionShape& b,
                                      const Pose& a_from_b) {
  Separation s;
  if (const auto b_in_a = inside(a, b, a_from_b)) {
    s.distance = -b_in_a->depth;
    s.normal = -b_in_a->outward;
    s.on_b = b_in_a->deepest;
    s.on_a = s.on_b + s.distance * s.normal;
    return s;
  }
  if (const auto a_in_b = inside(b, a, inverse(a_from_b))) {
    s.distance = -a_in_b->depth;
    s.normal = a_from_b.vector_to_world(a_in_b->outward);
    s.on_a = a_from_b.point_to_world(a_in_b->deepest);
    s.on_b = s.on_a - s.distance * s.normal;
    return s;
  }
  return std::nullopt;
}

}  // namespace

/// Returns the slot that contains a pair of pieces, or else the free slot in which it must be stored.
std::size_t PairCache::slot_of(uint32_t piece_a, uint32_t piece_b) const {
  const std::size_t mask = slots_.size() - 1;
  // Fibonacci hashing: the high bits of the product depend on all bits of both numbers.
  const uint64_t key = (uint64_t{piece_a} << 32 | piece_b) * 0x9e3779b97f4a7c15u;
  for (std::size_t slot = (key >> 32) & mask;; slot = (slot + 1) & mask) {
    const uint32_t index = slots_[slot];
    if (index == kNoEntry || (entries_[index].piece_a == piece_a && entries_[index].piece_b == piece_b))
      return slot;
  }
}

uint32_t PairCache::index_of(uint32_t piece_a, uint32_t piece_b) const {
  if (!slots_.empty()) return slots_[slot_of(piece_a, piece_b)];
  for (uint32_t k = 0; k < entries_.size(); ++k)
    if (entries_[k].piece_a == piece_a && entries_[k].piece_b == piece_b) return k;
  return kNoEntry;
}

void PairCache::rebuild_slots() {
  slots_.clear();
  if (entries_.size() <= kFewEntries) return;
  slots_.assign(std::bit_ceil(4 * entries_.size()), kNoEntry);
  for (uint32_t k = 0; k < entries_.size(); ++k)
    slots_[slot_of(entries_[k].piece_a, entries_[k].piece_b)] = k;
}

const PairCache::Entry* PairCache::find(uint32_t piece_a, uint32_t piece_b) const {
  const uint32_t index = index_of(piece_a, piece_b);
  return index == kNoEntry ? nullptr : &entries_[index];
}

PairCache::Entry& PairCache::of(uint32_t piece_a, uint32_t piece_b) {
  if (const uint32_t known = index_of(piece_a, piece_b); known != kNoEntry) {
    entries_[known].used = true;
    return entries_[known];
  }
  entries_.push_back(Used{{.piece_a = piece_a, .piece_b = piece_b}});
  if (entries_.size() > std::max(slots_.size() / 2, kFewEntries))
    rebuild_slots();
  else if (!slots_.empty())
    slots_[slot_of(piece_a, piece_b)] = static_cast<uint32_t>(entries_.size() - 1);
  return entries_.back();
}

void PairCache::forget_unused() {
  if (std::erase_if(entries_, [](const Used& e) { return !e.used; }) > 0) rebuild_slots();
  for (Used& e : entries_) e.used = false;
}

Separation piece_separation(const CollisionShape& a, uint32_t i, const CollisionShape& b, uint32_t j,
                            const Pose& a_from_b) {
  PairCache::Entry fresh{.piece_a = i, .piece_b = j, .gjk = {}, .vclip = {}};
  return measure(a, i, b, j, a_from_b, DistanceMethod::gjk, fresh);
}

std::optional<Separation> separation(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b,
                                     PairCache& cache, DistanceMethod method, Real limit) {
  assert(!a.is_plane());
  std::optional<Separation> nearest;
  if (b.is_plane()) {
    for (const Convex& hull : a.hulls()) {
      const Separation s = plane_separation(hull, a_from_b);
      if (s.distance <= limit && (!nearest || s.distance < nearest->distance)) nearest = s;
    }
    return nearest;
  }
  const auto distance = [&](uint32_t i, uint32_t j) {
    const Separation s = measure(a, i, b, j, a_from_b, method, cache.of(i, j));
    if (s.distance <= limit && (!nearest || s.distance < nearest->distance)) nearest = s;
    return s.distance;
  };
  with_trees(a, b, [&](const auto& tree_a, const auto& tree_b) {
    nearest_pair(tree_a, tree_b, placement(a, b, a_from_b, 0), limit, distance, cache.tests);
  });
  if (!nearest || nearest->distance > 0)
    if (const auto contained = containment(a, b, a_from_b)) return contained;
  return nearest;
}

bool touching(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, TestCounts& counts) {
  assert(!a.is_plane());
  if (b.is_plane())
    return std::ranges::any_of(
        a.hulls(), [&](const Convex& hull) { return plane_separation(hull, a_from_b).distance <= 0; });
  const bool as_triangles = are_triangles(a, b);
  const auto are_separated = [&](uint32_t i, uint32_t j) {
    const Convex p = a.piece(i), q = b.piece(j);
    if (as_triangles) return !triangles_intersect(vertices_of(p), placed_vertices(q, a_from_b));
    GjkCache fresh;
    return !overlap(p, q, a_from_b, fresh);
  };
  const bool apart = with_trees(a, b, [&](const auto& tree_a, const auto& tree_b) {
    return for_each_pair(tree_a, tree_b, placement(a, b, a_from_b, 0), are_separated, counts);
  });
  return !apart || containment(a, b, a_from_b);
}

bool touching(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b) {
  TestCounts counts;
  return touching(a, b, a_from_b, counts);
}

void find_manifolds(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, Real margin,
                    PairCache& cache, DistanceMethod method, std::vector<Manifold>& manifolds, bool turning) {
  assert(!a.is_plane());
  if (b.is_plane()) {
    for (std::size_t k = 0; k < a.hulls().size(); ++k) {
      Manifold m = plane_manifold(a.hulls()[k], inverse(a_from_b), margin);
      m.piece_a = a.first_piece(k);
      if (m.count > 0) manifolds.push_back(placed(m, a_from_b));
    }
    return;
  }
  const std::size_t before = manifolds.size();
  const auto visit = [&](uint32_t i, uint32_t j) {
    PiecePair(a, i, b, j, a_from_b, cache).find(margin, method, turning, manifolds);
  };
  if (a.piece_count() == 1 && b.piece_count() == 1) {
    ++cache.tests.pieces;
    visit(0, 0);
  } else {
    with_trees(a, b, [&](const auto& tree_a, const auto& tree_b) {
      for_each_pair(tree_a, tree_b, placement(a, b, a_from_b, margin), visit, cache.tests);
    });
    const CollisionMesh *mesh_a = a.surface(), *mesh_b = b.surface();
    if (mesh_b && !mesh_a) join_coplanar(manifolds, before, *mesh_b, a_from_b, true);
    if (mesh_a && !mesh_b) join_coplanar(manifolds, before, *mesh_a, Pose{}, false);
  }
  if (manifolds.size() > before) return;
  if (const auto s = containment(a, b, a_from_b)) {
    Manifold m;
    m.normal = s->normal;
    m.count = 1;
    m.points[0] = {s->on_a, s->on_b, s->distance, 0};
    manifolds.push_back(m);
  }
}

}  // namespace offstage::sim
