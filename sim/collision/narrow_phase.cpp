#include "sim/collision/narrow_phase.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "sim/collision/box_box.h"
#include "sim/collision/sphere_manifold.h"
#include "sim/collision/tree_pair.h"

namespace offstage::sim {
namespace {


Pose inverse(const Pose& p) {
  const Quat back = p.orientation.conjugate();
  return {back * -p.position, back};
}

Placement placement(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, Real margin) {
  return {a_from_b, a.hull().reach() + b.hull().reach(), margin};
}

Separation measure(const Convex& a, const Convex& b, const Pose& a_from_b, DistanceMethod method,
                   PairCache::Entry& entry) {
  const bool polyhedra = a.polyhedron && b.polyhedron && a.radius == 0 && b.radius == 0;
  if (method == DistanceMethod::vclip && polyhedra)
    return vclip(*a.polyhedron, *b.polyhedron, a_from_b, entry.vclip);
  return gjk(a, b, a_from_b, entry.gjk);
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

/// The manifold of two pieces, in the quickest way there is for their cores.
void find_manifold(const Convex& a, const Convex& b, const Pose& a_from_b, Real margin, DistanceMethod method,
                   PairCache& cache, std::pair<uint32_t, uint32_t> pieces, Manifold& m, MoreManifolds* more) {
  using Core = Convex::Core;
  if (is_sphere_pair(a, b)) {
    sphere_manifold(a, Pose{}, b, a_from_b, margin, m);
    return;
  }
  const bool boxes = a.core == Core::box && b.core == Core::box && a.radius == 0 && b.radius == 0;
  if (boxes && box_manifold(a, b, a_from_b, margin, m, more)) return;
  const Separation s = measure(a, b, a_from_b, method, cache.of(pieces.first, pieces.second));
  if (s.distance <= margin) m = manifold(a, b, a_from_b, s, margin, more);
}

/// How deep a shape is inside a hollow one that none of its pieces touches, as seen from the hollow one's
/// frame: it is pushed out whole along the way that its centre has to the surface. None if it is outside.
struct Inside {
  Real depth;
  Vec3 outward, deepest;  // hollow's frame
};
std::optional<Inside> inside(const CollisionShape& hollow, const CollisionShape& other,
                             const Pose& hollow_from_other) {
  if (!hollow.is_hollow() || other.is_plane()) return std::nullopt;
  const Vec3 centre = hollow_from_other.point_to_world(other.hull().centre());
  if (!hollow.tree().bounds().contains(centre)) return std::nullopt;
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

PairCache::Entry& PairCache::of(uint32_t piece_a, uint32_t piece_b) {
  const auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair(piece_a, piece_b),
                                   [](const Used& e, const std::pair<uint32_t, uint32_t>& key) {
                                     return std::pair(e.piece_a, e.piece_b) < key;
                                   });
  if (at != entries_.end() && at->piece_a == piece_a && at->piece_b == piece_b) {
    at->used = true;
    return *at;
  }
  return *entries_.insert(at, Used{{piece_a, piece_b, {}, {}}});
}

void PairCache::forget_unused() {
  std::erase_if(entries_, [](const Used& e) { return !e.used; });
  for (Used& e : entries_) e.used = false;
}

std::optional<Separation> separation(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b,
                                     PairCache& cache, DistanceMethod method, Real limit) {
  assert(!a.is_plane());
  std::optional<Separation> nearest;
  if (b.is_plane()) {
    nearest = plane_separation(a.hull(), a_from_b);
    if (nearest->distance > limit) nearest.reset();
    return nearest;
  }
  const auto distance = [&](uint32_t i, uint32_t j) {
    const Separation s = measure(a.piece(i), b.piece(j), a_from_b, method, cache.of(i, j));
    if (s.distance <= limit && (!nearest || s.distance < nearest->distance)) nearest = s;
    return s.distance;
  };
  nearest_pair(a.tree(), b.tree(), placement(a, b, a_from_b, 0), limit, distance);
  if (!nearest || nearest->distance > 0)
    if (const auto contained = containment(a, b, a_from_b)) return contained;
  return nearest;
}

bool touching(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b) {
  assert(!a.is_plane());
  if (b.is_plane()) return plane_separation(a.hull(), a_from_b).distance <= 0;
  const bool apart =
      for_each_pair(a.tree(), b.tree(), placement(a, b, a_from_b, 0), [&](uint32_t i, uint32_t j) {
        GjkCache fresh;
        return !overlap(a.piece(i), b.piece(j), a_from_b, fresh);
      });
  return !apart || containment(a, b, a_from_b);
}

void find_manifolds(const CollisionShape& a, const CollisionShape& b, const Pose& a_from_b, Real margin,
                    PairCache& cache, DistanceMethod method, std::vector<Manifold>& manifolds, bool turning) {
  assert(!a.is_plane());
  if (b.is_plane()) {
    const Manifold m = plane_manifold(a.hull(), inverse(a_from_b), margin);
    if (m.count > 0) manifolds.push_back(placed(m, a_from_b));
    return;
  }
  const std::size_t before = manifolds.size();
  const auto visit = [&](uint32_t i, uint32_t j) {
    std::optional<MoreManifolds> more;
    if (turning) more.emplace();
    find_manifold(a.piece(i), b.piece(j), a_from_b, margin, method, cache, {i, j}, manifolds.emplace_back(),
                  more ? &*more : nullptr);
    if (manifolds.back().count == 0) manifolds.pop_back();
    if (!more) return;
    for (const Manifold& m : more->manifolds)
      if (m.count > 0) manifolds.push_back(m);
  };
  if (a.piece_count() == 1 && b.piece_count() == 1)
    visit(0, 0);
  else
    for_each_pair(a.tree(), b.tree(), placement(a, b, a_from_b, margin), visit);
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
