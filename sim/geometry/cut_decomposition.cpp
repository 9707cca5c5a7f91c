#include "sim/geometry/cut_decomposition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/hull_merge.h"
#include "sim/geometry/winding_number.h"

namespace offstage::sim {
namespace {

using Plane = ConvexPolyhedron::Plane;
using Segment = SolidSamples::Segment;

/// Share of the accepted error that the cuts leave for mergers, which save more parts than they cost.
constexpr Real kForMergers = 0.35;
/// Share of the accepted error that all parts together may have.
constexpr Real kUsed = 0.95;
/// More pieces than wanted parts are made, before those that cost least are merged, and at most kMostPieces.
constexpr std::size_t kExcess = 2, kMostPieces = 1500;
/// Number of planes tried along each axis, and of refinements around the best one.
constexpr int kCoarse = 5, kRefinements = 3;
/// Number of flat sides whose planes are tried.
constexpr std::size_t kFlatSides = 6;
/// Penalty for halves of different size, as a share of the difference of their volumes.
constexpr Real kBalance = 0.03;
/// A surface that extends less than this across a plane, as a share of the mesh's size, only touches it.
constexpr Real kTouch = 1e-7;
/// How far a corner of a cell is moved inwards for the test whether the solid is there, as a share of the
/// way.
constexpr Real kNearby = 0.01;
/// Axes that differ by less than this are tried once [1 - cosine].
constexpr Real kSameAxis = 0.01;
/// Hulls of more points than this are compared by their extreme points in kDirections directions.
constexpr std::size_t kManyPoints = 300;
constexpr int kDirections = 128;

Real height(const Plane& plane, const Vec3& p) {
  return plane.normal.dot(p) - plane.offset;
}

Plane opposite(const Plane& plane) {
  return {-plane.normal, -plane.offset};
}

/// Directions spread evenly over the sphere, along a spiral.
const std::vector<Vec3>& directions() {
  static const std::vector<Vec3> all = [] {
    std::vector<Vec3> list;
    // The golden angle: its cosine and sine rotate from one direction to the next.
    const Real c = -0.7373688780783197, s = 0.6754902942615238;
    Real x = 1, y = 0;
    for (int i = 0; i < kDirections; ++i) {
      const Real z = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - z * z);
      list.emplace_back(r * x, r * y, z);
      const Real next = c * x - s * y;
      y = s * x + c * y;
      x = next;
    }
    return list;
  }();
  return all;
}

/// The volume of the hull, of a subset of the points if there are many.
Real compared_volume(const std::vector<Vec3>& points) {
  if (points.size() < 4) return 0;
  if (points.size() <= kManyPoints) return hull_volume(convex_hull(points));
  std::vector<uint32_t> extreme;
  for (const Vec3& d : directions()) {
    uint32_t best = 0;
    Real farthest = -std::numeric_limits<Real>::infinity();
    for (uint32_t i = 0; i < points.size(); ++i)
      if (const Real at = d.dot(points[i]); at > farthest) {
        farthest = at;
        best = i;
      }
    extreme.push_back(best);
  }
  std::sort(extreme.begin(), extreme.end());
  extreme.erase(std::unique(extreme.begin(), extreme.end()), extreme.end());
  std::vector<Vec3> some;
  for (uint32_t i : extreme) some.push_back(points[i]);
  return hull_volume(convex_hull(some));
}

/// The part of the solid in a cell between cut planes.
struct Piece {
  ConvexPolyhedron cell;
  std::vector<char> is_inside;  ///< by corner of the cell: whether the solid is there
  // The surface in the cell: corners of polygons, and where each polygon begins.
  std::vector<Vec3> corners;
  std::vector<uint32_t> begins{0};
  std::vector<Segment> segments;
  ConvexPolyhedron hull;
  Real excess = 0;  ///< volume of the hull over that of the solid [m^3]
};

class Cutter {
 public:
  Cutter(const TriangleMesh& mesh, bool is_closed, const SolidSamples& samples, const CutGoal& goal)
      : winding_(mesh), is_closed_(is_closed), samples_(samples), goal_(goal) {
    Aabb box;
    for (const Vec3& v : mesh.vertices) box.extend(v);
    touch_ = kTouch * box.diagonal().norm();
    Piece whole;
    const Aabb around(box.min() - 0.1 * box.sizes() - Vec3::Constant(touch_),
                      box.max() + 0.1 * box.sizes() + Vec3::Constant(touch_));
    std::vector<Vec3> corners;
    for (int k = 0; k < 8; ++k) corners.push_back(around.corner(static_cast<Aabb::CornerType>(k)));
    whole.cell = convex_hull(corners);
    whole.is_inside.assign(whole.cell.vertices().size(), false);
    for (const Triangle& t : mesh.triangles) {
      for (uint32_t v : t) whole.corners.push_back(mesh.vertices[v]);
      whole.begins.push_back(static_cast<uint32_t>(whole.corners.size()));
    }
    whole.segments = samples.segments;
    finish(whole);
    pieces_.push_back(std::move(whole));
  }

  std::vector<ConvexPolyhedron> run() {
    const Real cut_to = (1 - kForMergers) * kUsed * goal_.max_error * goal_.volume;
    const std::size_t most = std::min<std::size_t>(kExcess * goal_.max_parts, kMostPieces);
    while (pieces_.size() < most && excess() > cut_to)
      if (!halve_worst()) break;
    std::vector<ConvexPolyhedron> parts;
    Real volume = 0;
    for (Piece& p : pieces_) {
      if (p.hull.dimension() < 3) continue;
      volume += hull_volume(p.hull);
      parts.push_back(std::move(p.hull));
    }
    const Real room = (1 + kUsed * goal_.max_error) * goal_.volume - volume;
    return merge_hulls(std::move(parts), goal_.max_parts, std::max(room, 0.0));
  }

 private:
  struct RatedPlane {
    Plane plane;
    Real cost = std::numeric_limits<Real>::infinity();
  };

  Real excess() const {
    Real sum = 0;
    for (const Piece& p : pieces_) sum += p.excess;
    return sum;
  }

  /// Appends the points of a piece on the positive side of a plane whose hull is that of the side: corners of
  /// the surface and where the plane cuts it, and corners of the cell and where the plane cuts it, if they
  /// are inside the solid.
  void add_points(const Piece& piece, const Plane& plane, std::vector<Vec3>& points) const {
    for (std::size_t k = 0; k + 1 < piece.begins.size(); ++k) {
      const uint32_t first = piece.begins[k], end = piece.begins[k + 1];
      Real highest = -1;
      for (uint32_t i = first; i < end; ++i) highest = std::max(highest, height(plane, piece.corners[i]));
      if (highest <= touch_) continue;
      for (uint32_t i = first; i < end; ++i) {
        const Vec3 &a = piece.corners[i], &b = piece.corners[i + 1 < end ? i + 1 : first];
        const Real ha = height(plane, a), hb = height(plane, b);
        if (ha >= 0) points.push_back(a);
        if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) points.push_back(a + ha / (ha - hb) * (b - a));
      }
    }
    for (std::size_t i = 0; i < piece.is_inside.size(); ++i)
      if (piece.is_inside[i] && height(plane, piece.cell.vertices()[i]) >= 0)
        points.push_back(piece.cell.vertices()[i]);
    for (const ConvexPolyhedron::Edge& e : piece.cell.edges())
      if (const auto p = crossing(piece.cell, e, plane); p && is_inside(*p, piece.cell.centre()))
        points.push_back(*p);
    if (is_closed_) return;
    for (const Segment& s : piece.segments)
      for (const Vec3& end : {s.low, s.high})
        if (height(plane, end) >= 0) points.push_back(end);
  }

  static std::optional<Vec3> crossing(const ConvexPolyhedron& cell, const ConvexPolyhedron::Edge& e,
                                      const Plane& plane) {
    const Vec3 &a = cell.vertex(e.tail), &b = cell.vertex(e.head);
    const Real ha = height(plane, a), hb = height(plane, b);
    if ((ha > 0) == (hb > 0)) return {};
    return a + ha / (ha - hb) * (b - a);
  }

  bool is_inside(const Vec3& corner, const Vec3& centre) const {
    return std::abs(winding_.at(corner + kNearby * (centre - corner))) > 0.5;
  }

  /// The part of a piece on the positive side of a plane.
  Piece side(const Piece& piece, const Plane& plane) const {
    Piece part;
    std::vector<Vec3> cell;
    for (const Vec3& v : piece.cell.vertices())
      if (height(plane, v) > 0) cell.push_back(v);
    for (const ConvexPolyhedron::Edge& e : piece.cell.edges())
      if (const auto p = crossing(piece.cell, e, plane)) cell.push_back(*p);
    part.cell = convex_hull(cell);
    for (const Vec3& v : part.cell.vertices()) part.is_inside.push_back(is_inside(v, part.cell.centre()));
    for (std::size_t k = 0; k + 1 < piece.begins.size(); ++k) clip(piece, k, plane, part);
    for (Segment s : piece.segments) {
      const Real low = height(plane, s.low), high = height(plane, s.high);
      if (low <= 0 && high <= 0) continue;
      const Vec3 middle = low == high ? s.low : Vec3(s.low + low / (low - high) * (s.high - s.low));
      if (low < 0) s.low = middle;
      if (high < 0) s.high = middle;
      part.segments.push_back(s);
    }
    finish(part);
    return part;
  }

  /// Appends the part of a polygon above a plane; nothing if the polygon only touches it.
  void clip(const Piece& piece, std::size_t polygon, const Plane& plane, Piece& part) const {
    const uint32_t first = piece.begins[polygon], end = piece.begins[polygon + 1];
    Real highest = -1;
    for (uint32_t i = first; i < end; ++i) highest = std::max(highest, height(plane, piece.corners[i]));
    if (highest <= touch_) return;
    for (uint32_t i = first; i < end; ++i) {
      const Vec3 &a = piece.corners[i], &b = piece.corners[i + 1 < end ? i + 1 : first];
      const Real ha = height(plane, a), hb = height(plane, b);
      if (ha >= 0) part.corners.push_back(a);
      if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) part.corners.push_back(a + ha / (ha - hb) * (b - a));
    }
    part.begins.push_back(static_cast<uint32_t>(part.corners.size()));
  }

  /// Sets the hull and the excess.
  void finish(Piece& piece) const {
    std::vector<Vec3> points = piece.corners;
    for (std::size_t i = 0; i < piece.is_inside.size(); ++i)
      if (piece.is_inside[i]) points.push_back(piece.cell.vertices()[i]);
    Real length = 0;
    for (const Segment& s : piece.segments) {
      length += (s.high - s.low).norm();
      if (is_closed_) continue;
      points.push_back(s.low);
      points.push_back(s.high);
    }
    if (points.empty()) return;
    piece.hull = convex_hull(points);
    piece.excess = std::max(0.0, hull_volume(piece.hull) - samples_.line_area * length);
  }

  bool halve_worst() {
    const auto worst = std::max_element(pieces_.begin(), pieces_.end(),
                                        [](const Piece& a, const Piece& b) { return a.excess < b.excess; });
    const RatedPlane best = best_plane(*worst);
    if (!std::isfinite(best.cost)) return false;
    std::array<Piece, 2> halves;
    tbb::parallel_for(0, 2, [&](int k) {
      halves[static_cast<std::size_t>(k)] = side(*worst, k == 0 ? best.plane : opposite(best.plane));
    });
    *worst = std::move(halves[0]);
    pieces_.push_back(std::move(halves[1]));
    return true;
  }

  /// The axes along which planes are tried: the principal ones of the surface in the piece, and the world's.
  static std::vector<Vec3> axes(const Piece& piece) {
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : piece.corners) mean += p;
    mean /= static_cast<Real>(piece.corners.size());
    Mat3 spread = Mat3::Zero();
    for (const Vec3& p : piece.corners) spread += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(spread);
    std::vector<Vec3> list;
    const auto add = [&](const Vec3& axis) {
      for (const Vec3& other : list)
        if (1 - std::abs(axis.dot(other)) < kSameAxis) return;
      list.push_back(axis);
    };
    for (int k = 0; k < 3; ++k) add(Vec3::Unit(k));
    if (solver.info() == Eigen::Success)
      for (int k = 2; k >= 0; --k) add(solver.eigenvectors().col(k));
    return list;
  }

  static std::pair<Real, Real> extent(const Piece& piece, const Vec3& axis) {
    Real low = std::numeric_limits<Real>::infinity(), high = -low;
    for (const Vec3& p : piece.corners) {
      low = std::min(low, axis.dot(p));
      high = std::max(high, axis.dot(p));
    }
    return {low, high};
  }

  /// The planes of the largest polygons that have surface on both sides.
  std::vector<Plane> flat_sides(const Piece& piece) const {
    struct Side {
      Plane plane;
      Real area;
    };
    std::vector<Side> sides;
    for (std::size_t k = 0; k + 1 < piece.begins.size(); ++k) {
      Vec3 normal = Vec3::Zero();
      const Vec3& origin = piece.corners[piece.begins[k]];
      for (uint32_t i = piece.begins[k] + 1; i + 1 < piece.begins[k + 1]; ++i)
        normal += (piece.corners[i] - origin).cross(piece.corners[i + 1] - origin);
      const Real area = normal.norm();
      if (area > 0) sides.push_back({{normal / area, normal.dot(origin) / area}, area});
    }
    const std::size_t some = std::min(sides.size(), 8 * kFlatSides);
    std::partial_sort(sides.begin(), sides.begin() + static_cast<std::ptrdiff_t>(some), sides.end(),
                      [](const Side& a, const Side& b) { return a.area > b.area; });
    sides.resize(some);
    std::vector<Plane> planes;
    for (const Side& s : sides) {
      const auto is_same = [&](const Plane& p) {
        return 1 - std::abs(p.normal.dot(s.plane.normal)) < 1e-6 &&
               std::abs(std::abs(p.offset) - std::abs(s.plane.offset)) < 1e3 * touch_;
      };
      if (planes.size() == kFlatSides) break;
      if (std::any_of(planes.begin(), planes.end(), is_same)) continue;
      const auto [low, high] = extent(piece, s.plane.normal);
      if (s.plane.offset - low > 1e3 * touch_ && high - s.plane.offset > 1e3 * touch_)
        planes.push_back(s.plane);
    }
    return planes;
  }

  RatedPlane best_plane(const Piece& piece) const {
    if (piece.corners.empty()) return {};
    std::vector<RatedPlane> planes;
    for (const Vec3& axis : axes(piece)) {
      const auto [low, high] = extent(piece, axis);
      if (high - low < 1e3 * touch_) continue;
      for (int k = 1; k <= kCoarse; ++k) planes.push_back({{axis, low + (high - low) * k / (kCoarse + 1)}});
    }
    for (const Plane& plane : flat_sides(piece)) planes.push_back({plane});
    RatedPlane best = cheapest(piece, planes);
    const auto [low, high] = extent(piece, best.plane.normal);
    Real step = (high - low) / (kCoarse + 1);
    for (int k = 0; k < kRefinements && std::isfinite(best.cost); ++k) {
      step /= 2;
      planes.clear();
      for (const Real at : {best.plane.offset - step, best.plane.offset + step})
        if (at > low && at < high) planes.push_back({{best.plane.normal, at}});
      const RatedPlane next = cheapest(piece, planes);
      if (next.cost < best.cost) best = next;
    }
    return best;
  }

  RatedPlane cheapest(const Piece& piece, std::vector<RatedPlane>& planes) const {
    tbb::parallel_for(std::size_t{0}, planes.size(),
                      [&](std::size_t k) { planes[k].cost = cost(piece, planes[k].plane); });
    RatedPlane best;
    for (const RatedPlane& p : planes)
      if (p.cost < best.cost) best = p;
    return best;
  }

  /// Volume of the two hulls plus a penalty for halves of different size; infinite if one is empty.
  Real cost(const Piece& piece, const Plane& plane) const {
    std::vector<Vec3> above, below;
    add_points(piece, plane, above);
    add_points(piece, opposite(plane), below);
    if (above.empty() || below.empty()) return std::numeric_limits<Real>::infinity();
    const Real a = compared_volume(above), b = compared_volume(below);
    return a + b + kBalance * std::abs(a - b);
  }

  WindingNumber winding_;
  bool is_closed_;
  const SolidSamples& samples_;
  CutGoal goal_;
  Real touch_ = 0;
  std::vector<Piece> pieces_;
};

}  // namespace

std::vector<ConvexPolyhedron> decompose_by_cuts(const TriangleMesh& mesh, bool is_closed,
                                                const SolidSamples& samples, const CutGoal& goal) {
  if (samples.segments.empty()) return {};
  return Cutter(mesh, is_closed, samples, goal).run();
}

}  // namespace offstage::sim
