#include "sim/geometry/hull_merge.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include <tbb/parallel_for.h>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/hull_sketch.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/solid_piece.h"

namespace offstage::sim {
namespace {

constexpr Real kApart = std::numeric_limits<Real>::infinity();
constexpr uint32_t kSeveral = 0xffffffff;
/// Hulls with more vertices than this are represented, in comparisons, by their extreme points in this many
/// directions.
constexpr std::size_t kManyVertices = 192;
/// Greatest number of faces of a hull by which another hull is cut.
constexpr std::size_t kMainPlanes = 96;
/// Distances below this fraction of a hull's extent count as zero.
constexpr Real kOnPlane = 1e-9;

ConvexPolyhedron common_hull(const ConvexPolyhedron& a, const ConvexPolyhedron& b) {
  std::vector<Vec3> points(a.vertices().begin(), a.vertices().end());
  points.insert(points.end(), b.vertices().begin(), b.vertices().end());
  return convex_hull(points);
}

/// Returns the planes of the largest faces.
std::vector<SolidPiece::Plane> main_planes(const ConvexPolyhedron& p) {
  std::vector<std::pair<Real, uint32_t>> faces;
  for (uint32_t f = 0; f < p.face_count(); ++f) {
    const auto corners = p.face_vertices(f);
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 1; k + 1 < corners.size(); ++k)
      sum += (p.vertex(corners[k]) - p.vertex(corners[0]))
                 .cross(p.vertex(corners[k + 1]) - p.vertex(corners[0]));
    faces.emplace_back(-sum.norm(), f);
  }
  std::sort(faces.begin(), faces.end());
  faces.resize(std::min(faces.size(), kMainPlanes));
  std::vector<SolidPiece::Plane> planes;
  for (const auto& [area, f] : faces) planes.push_back(p.plane(f));
  return planes;
}

/// Returns the volume of the intersection of two hulls [m^3]. It is slightly too large if `b` has more than
/// kMainPlanes faces. The function is faster if `a` is the smaller hull.
Real common_volume(const ConvexPolyhedron& a, const ConvexPolyhedron& b) {
  if (a.dimension() < 3 || b.dimension() < 3) return 0;
  const Real tolerance = kOnPlane * a.box().diagonal().norm();
  SolidPiece rest = solid_piece(a);
  for (const SolidPiece::Plane& plane : main_planes(b)) {
    const auto above = [&](const Vec3& p) { return plane.normal.dot(p) - plane.offset > tolerance; };
    if (std::any_of(rest.points.begin(), rest.points.end(), above))
      rest = std::move(cut(rest, plane, tolerance)[1]);
  }
  return rest.points.empty() ? 0 : std::max(0.0, moments(rest).volume);
}

/// Returns a similar hull with few vertices, for comparisons.
ConvexPolyhedron thinned(const ConvexPolyhedron& p) {
  if (p.vertices().size() <= kManyVertices) return p;
  return convex_hull(extreme_points(p.vertices(), static_cast<int>(kManyVertices)));
}

}  // namespace

class HullMerger::Mergers {
 public:
  explicit Mergers(std::span<const HullToMerge> parts) {
    for (const HullToMerge& p : parts) {
      solids_.push_back(p.solid);
      parts_.push_back({thinned(p.hull), {static_cast<uint32_t>(parts_.size())}, 0});
      volumes_.push_back(hull_volume(parts_.back().hull));
    }
    find_gains(false);
  }

  std::vector<MergedHull> run(std::size_t max_parts, Real budget) {
    Real spent = 0;
    while (parts_.size() > 1) {
      Pair best = cheapest();
      if (spent + best.gain > budget && parts_.size() <= max_parts) break;
      if (best.gain == kApart) {
        find_gains(true);
        best = cheapest();
      }
      spent += best.gain;
      join(best);
    }
    return std::move(parts_);
  }

 private:
  struct Pair {
    std::size_t a = 0, b = 1;
    Real gain = kApart;
  };

  Real gain(std::size_t a, std::size_t b, bool even_apart) const {
    const ConvexPolyhedron &p = parts_[a].hull, &q = parts_[b].hull;
    if (!even_apart && !p.box().intersects(q.box())) return kApart;
    return hull_volume(common_hull(p, q)) - volumes_[a] - volumes_[b] + shared(a, b);
  }

  Real shared(std::size_t a, std::size_t b) const {
    if (solids_[a] == solids_[b] && solids_[a] != kSeveral) return 0;
    const bool ordered = volumes_[a] <= volumes_[b];
    return common_volume(parts_[ordered ? a : b].hull, parts_[ordered ? b : a].hull);
  }

  void find_gains(bool even_apart) {
    const std::size_t n = parts_.size();
    gains_.assign(n, std::vector<Real>(n, kApart));
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t a) {
      for (std::size_t b = a + 1; b < n; ++b) gains_[a][b] = gain(a, b, even_apart);
    });
  }

  Pair cheapest() const {
    Pair best;
    for (std::size_t a = 0; a < parts_.size(); ++a)
      for (std::size_t b = a + 1; b < parts_.size(); ++b)
        if (gains_[a][b] < best.gain) best = {a, b, gains_[a][b]};
    return best;
  }

  /// Joins a pair of parts. The common hull replaces the first part, and the second part is removed.
  void join(const Pair& pair) {
    const auto erase = [&](auto& list) { list.erase(list.begin() + static_cast<std::ptrdiff_t>(pair.b)); };
    MergedHull &kept = parts_[pair.a], &gone = parts_[pair.b];
    kept.shared += gone.shared + shared(pair.a, pair.b);
    kept.hull = common_hull(kept.hull, gone.hull);
    kept.members.insert(kept.members.end(), gone.members.begin(), gone.members.end());
    volumes_[pair.a] = hull_volume(kept.hull);
    erase(parts_);
    if (solids_[pair.a] != solids_[pair.b]) solids_[pair.a] = kSeveral;
    erase(volumes_);
    erase(solids_);
    erase(gains_);
    for (std::vector<Real>& row : gains_) erase(row);
    tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t k) {
      const std::size_t a = std::min(k, pair.a), b = std::max(k, pair.a);
      if (a != b) gains_[a][b] = gain(a, b, false);
    });
  }

  std::vector<MergedHull> parts_;
  std::vector<Real> volumes_;
  std::vector<uint32_t> solids_;          // kSeveral for a hull of parts of different solids
  std::vector<std::vector<Real>> gains_;  // gain of joining a and b at [a][b], a < b
};

Real hull_volume(const ConvexPolyhedron& p) {
  return p.dimension() == 3 ? mass_properties(p.triangles()).volume : 0;
}

HullMerger::HullMerger(std::span<const HullToMerge> parts)
    : parts_(parts), start_(std::make_unique<const Mergers>(parts)) {}

HullMerger::~HullMerger() = default;

std::vector<MergedHull> HullMerger::run(std::size_t max_parts, Real budget) const {
  std::vector<MergedHull> merged = Mergers(*start_).run(max_parts, budget);
  tbb::parallel_for(std::size_t{0}, merged.size(), [&](std::size_t k) {
    std::vector<Vec3> points;
    for (uint32_t m : merged[k].members)
      points.insert(points.end(), parts_[m].hull.vertices().begin(), parts_[m].hull.vertices().end());
    merged[k].hull = convex_hull(points);
  });
  return merged;
}

}  // namespace offstage::sim
