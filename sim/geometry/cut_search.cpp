#include "sim/geometry/cut_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/hull_merge.h"
#include "sim/geometry/hull_sketch.h"

namespace offstage::sim {
namespace {

using SearchPlane = SolidPiece::Plane;

/// Number of planes tried along each axis, and of refinements around the best plane.
constexpr int kAlongAxis = 7, kRefined = 4;
/// Number of flat sides and of reflex edges whose planes are tried.
constexpr std::size_t kFlatPlanes = 8, kReflexTried = 6;
/// Weight of compactness in the cost of a cut, relative to the volume of the hulls. Thin shells need it,
/// because no single cut makes their hulls smaller.
constexpr Real kCompact = 1;
/// Two axes count as the same if 1 minus the cosine of their angle is less than this.
constexpr Real kSameDirection = 1e-3;
/// A reflex edge is sharp if the sine of its angle is at least this.
constexpr Real kSharp = 0.09;

struct RatedPlane {
  SearchPlane plane;
  Real cost = kInfinity;
};

class CutSearch {
 public:
  CutSearch(const HulledPiece& piece, Real tolerance)
      : piece_(piece), solid_(piece.solid), tolerance_(tolerance), edges_(edges(piece.solid)) {
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : solid_.points) mean += p;
    mean /= static_cast<Real>(solid_.points.size());
    for (const Vec3& p : solid_.points) spread_ += (p - mean) * (p - mean).transpose();
    spread_ /= static_cast<Real>(solid_.points.size());
  }

  RatedPlane run(const std::vector<ReflexEdge>& reflex) const {
    std::vector<RatedPlane> planes;
    for (const Vec3& axis : axes()) {
      const auto [low, high] = extent(axis);
      if (high - low < kThin * tolerance_) continue;
      for (int k = 1; k <= kAlongAxis; ++k)
        planes.push_back({{axis, low + (high - low) * k / (kAlongAxis + 1)}});
    }
    add_flat_sides(planes);
    add_reflex(reflex, planes);
    RatedPlane best = cheapest(planes);
    const auto [low, high] = extent(best.plane.normal);
    Real step = (high - low) / (kAlongAxis + 1);
    for (int k = 0; k < kRefined && best.cost < kInfinity; ++k) {
      step /= 2;
      planes.clear();
      for (const Real at : {best.plane.offset - step, best.plane.offset + step})
        if (at > low && at < high) planes.push_back({{best.plane.normal, at}});
      const RatedPlane next = cheapest(planes);
      if (next.cost < best.cost) best = next;
    }
    return best;
  }

 private:
  /// A plane that is closer to the end of a piece than this many tolerances does not divide the piece.
  static constexpr Real kThin = 100;

  /// Returns the principal axes of the points and the axes of the frame.
  std::vector<Vec3> axes() const {
    std::vector<Vec3> list;
    const auto add = [&](const Vec3& axis) {
      for (const Vec3& other : list)
        if (1 - std::abs(axis.dot(other)) < kSameDirection) return;
      list.push_back(axis);
    };
    for (int k = 0; k < 3; ++k) add(Vec3::Unit(k));
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(spread_);
    if (solver.info() == Eigen::Success)
      for (int k = 2; k >= 0; --k) add(solver.eigenvectors().col(k));
    return list;
  }

  std::pair<Real, Real> extent(const Vec3& axis) const {
    Real low = kInfinity, high = -kInfinity;
    for (const Vec3& p : piece_.hull.vertices()) {
      low = std::min(low, axis.dot(p));
      high = std::max(high, axis.dot(p));
    }
    return {low, high};
  }

  /// Adds a plane to the list if it divides the piece and is not yet in the list.
  void add_plane(const SearchPlane& plane, std::vector<RatedPlane>& planes) const {
    for (const RatedPlane& other : planes)
      if (1 - std::abs(other.plane.normal.dot(plane.normal)) < 1e-9 &&
          std::abs(std::abs(other.plane.offset) - std::abs(plane.offset)) < kThin * tolerance_)
        return;
    const auto [low, high] = extent(plane.normal);
    if (plane.offset - low > kThin * tolerance_ && high - plane.offset > kThin * tolerance_)
      planes.push_back({plane});
  }

  /// Adds the planes of the largest polygons, if the piece has surface on both sides of the plane.
  void add_flat_sides(std::vector<RatedPlane>& planes) const {
    std::vector<std::pair<Real, SearchPlane>> sides;
    for (std::size_t k = 0; k < solid_.polygon_count(); ++k) {
      const Vec3& origin = solid_.points[solid_.corners[solid_.first[k]]];
      Vec3 normal = Vec3::Zero();
      for (uint32_t i = solid_.first[k] + 1; i + 1 < solid_.first[k + 1]; ++i)
        normal +=
            (solid_.points[solid_.corners[i]] - origin).cross(solid_.points[solid_.corners[i + 1]] - origin);
      const Real area = normal.norm();
      if (area > 0) sides.push_back({area, {normal / area, normal.dot(origin) / area}});
    }
    std::stable_sort(sides.begin(), sides.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    sides.resize(std::min(sides.size(), 4 * kFlatPlanes));
    const std::size_t most = planes.size() + kFlatPlanes;
    for (const auto& side : sides)
      if (planes.size() < most) add_plane(side.second, planes);
  }

  /// Adds planes through the longest and sharpest reflex edges: the planes of the two faces, and planes
  /// between them.
  void add_reflex(const std::vector<ReflexEdge>& reflex, std::vector<RatedPlane>& planes) const {
    const Aabb box = piece_.hull.box();
    std::vector<std::pair<Real, const ReflexEdge*>> here;
    for (const ReflexEdge& e : reflex) {
      if (!box.contains((e.from + e.to) / 2)) continue;
      here.emplace_back((e.to - e.from).norm() * e.left.cross(e.right).norm(), &e);
    }
    std::stable_sort(here.begin(), here.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    here.resize(std::min(here.size(), kReflexTried));
    for (const auto& [weight, e] : here) {
      const Vec3 between = e->left - e->right;
      for (const Vec3& normal : {between, e->left, e->right})
        if (const Vec3 unit = normal.normalized(); unit.allFinite())
          add_plane({unit, unit.dot((e->from + e->to) / 2)}, planes);
    }
  }

  RatedPlane cheapest(std::vector<RatedPlane>& planes) const {
    tbb::parallel_for(std::size_t{0}, planes.size(),
                      [&](std::size_t k) { planes[k].cost = cost(planes[k].plane); });
    RatedPlane best;
    for (const RatedPlane& p : planes)
      if (p.cost < best.cost) best = p;
    return best;
  }

  /// Returns the cost of a cut: the volume of both hulls plus a fraction of the excess. The less compact the
  /// two sides are, the larger is this fraction.
  Real cost(const SearchPlane& plane) const {
    std::array<std::vector<Vec3>, 2> sides;
    std::vector<Real> height;
    height.reserve(solid_.points.size());
    for (const Vec3& p : solid_.points) {
      const Real h = plane.normal.dot(p) - plane.offset;
      height.push_back(std::abs(h) <= tolerance_ ? 0 : h);
      if (height.back() != 0) sides[height.back() > 0 ? 0 : 1].push_back(p);
    }
    // A point on the plane is added to each side to which one of its edges leads.
    std::vector<std::array<bool, 2>> added(solid_.points.size());
    for (const auto& [a, b] : edges_) {
      const Real ha = height[a], hb = height[b];
      if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) {
        const Vec3 middle = solid_.points[a] + ha / (ha - hb) * (solid_.points[b] - solid_.points[a]);
        for (auto& side : sides) side.push_back(middle);
      } else if ((ha == 0) != (hb == 0)) {
        const uint32_t on = ha == 0 ? a : b;
        const std::size_t side = ha + hb > 0 ? 0 : 1;
        if (!std::exchange(added[on][side], true)) sides[side].push_back(solid_.points[on]);
      }
    }
    if (sides[0].empty() || sides[1].empty()) return kInfinity;
    return sketched_hull_volume(sides[0]) + sketched_hull_volume(sides[1]) +
           kCompact * piece_.excess * (1 - compactness(plane));
  }

  /// Returns the fraction of the piece's spread that the cut removes. It follows from the distance between
  /// the centres of both sides.
  Real compactness(const SearchPlane& plane) const {
    const PieceMoments &all = piece_.moments, above = moments_above(solid_, plane);
    const Real f = above.volume / all.volume;
    if (!(f > 0) || !(f < 1)) return 0;
    const Real distance = plane.normal.dot(above.first / above.volume -
                                           (all.first - above.first) / (all.volume - above.volume));
    return std::min(1.0, f * (1 - f) * distance * distance / spread_.trace());
  }

  const HulledPiece& piece_;
  const SolidPiece& solid_;
  Real tolerance_;
  std::vector<SolidPiece::Side> edges_;
  Mat3 spread_ = Mat3::Zero();  // second moments of the points about their mean
};

}  // namespace

HulledPiece with_hull(SolidPiece solid, uint32_t solid_id) {
  HulledPiece piece{std::move(solid), {}, {}, 0, solid_id};
  if (piece.solid.points.size() < 4) return piece;
  piece.hull = convex_hull(piece.solid.points);
  piece.moments = moments(piece.solid);
  piece.excess = std::max(0.0, hull_volume(piece.hull) - std::max(0.0, piece.moments.volume));
  return piece;
}

std::vector<ReflexEdge> sharp_reflex_edges(const SolidPiece& solid) {
  struct Half {
    Vec3 normal;
    Vec3 inward;  // direction from the edge towards a third corner
  };
  std::unordered_map<uint64_t, Half> halves;
  std::vector<ReflexEdge> list;
  for (std::size_t k = 0; k < solid.polygon_count(); ++k) {
    const uint32_t begin = solid.first[k], n = solid.first[k + 1] - begin;
    const auto corner = [&](uint32_t i) { return solid.corners[begin + i % n]; };
    const auto point = [&](uint32_t i) -> const Vec3& { return solid.points[corner(i)]; };
    const Vec3 normal = (point(1) - point(0)).cross(point(2) - point(0)).normalized();
    for (uint32_t i = 0; i < n; ++i) {
      const uint64_t a = corner(i), b = corner(i + 1);
      const Half here{normal, point(i + 2) - point(i)};
      const auto other = halves.find((b << 32) | a);
      if (other == halves.end()) {
        halves.emplace((a << 32) | b, here);
        continue;
      }
      const bool reflex = here.normal.dot(other->second.inward) > 0;
      if (reflex && here.normal.cross(other->second.normal).norm() > kSharp)
        list.push_back({point(i), point(i + 1), normal, other->second.normal});
    }
  }
  return list;
}

std::optional<SolidPiece::Plane> best_cut(const HulledPiece& piece, const std::vector<ReflexEdge>& reflex,
                                          Real tolerance) {
  if (piece.solid.points.size() < 4 || piece.hull.dimension() < 3) return {};
  const RatedPlane best = CutSearch(piece, tolerance).run(reflex);
  if (!(best.cost < kInfinity)) return {};
  return best.plane;
}

}  // namespace offstage::sim
