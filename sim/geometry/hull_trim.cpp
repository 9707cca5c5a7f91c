#include "sim/geometry/hull_trim.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/hull_merge.h"

namespace offstage::sim {
namespace {

using TrimPlane = SolidPiece::Plane;

/// Number of depths that are tried for each face.
constexpr int kDepths = 6;
/// Greatest number of faces of one hull that are moved.
constexpr int kMostTrims = 24;
/// If the surface of the solid covers more than this fraction of a face, the face does not bridge a hollow.
constexpr Real kCovered = 0.5;
/// A face moves by at most this fraction of the hull's extent along its normal.
constexpr Real kMostOfHull = 0.25;
/// Greatest fraction of the pieces' volume that may end up outside of their trimmed hull.
constexpr Real kMostLost = 0.03;
/// Distances below this fraction of the hull's extent count as zero.
constexpr Real kOnFace = 1e-6;

ConvexPolyhedron below(const ConvexPolyhedron& hull, const TrimPlane& plane) {
  std::vector<Vec3> points;
  const auto height = [&](uint32_t v) { return plane.normal.dot(hull.vertex(v)) - plane.offset; };
  for (uint32_t v = 0; v < hull.vertices().size(); ++v)
    if (height(v) <= 0) points.push_back(hull.vertex(v));
  for (const ConvexPolyhedron::Edge& e : hull.edges()) {
    const Real a = height(e.tail), b = height(e.head);
    if ((a > 0) != (b > 0) && a != 0 && b != 0)
      points.push_back(hull.vertex(e.tail) + a / (a - b) * (hull.vertex(e.head) - hull.vertex(e.tail)));
  }
  return convex_hull(points);
}

class HullTrimmer {
 public:
  HullTrimmer(ConvexPolyhedron hull, std::span<const SolidPiece* const> pieces, Real shared, Real limit)
      : hull_(std::move(hull)), pieces_(pieces), limit_(limit) {
    Real solid = -shared;
    for (const SolidPiece* p : pieces_) solid += moments(*p).volume;
    error_ = std::max(0.0, hull_volume(hull_) - solid);
    may_lose_ = kMostLost * std::max(0.0, solid);
    on_face_ = kOnFace * hull_.box().diagonal().norm();
  }

  TrimmedHull run() {
    std::vector<TrimPlane> faces = bridges();
    for (const TrimPlane& face : faces) {
      const SolidPiece whole = solid_piece(hull_);
      Trim best;
      const Real most = std::min(limit_, kMostOfHull * extent(face));
      for (int k = 1; k <= kDepths; ++k) {
        const Real depth = most * k * k / (kDepths * kDepths);
        const Trim trim = trimmed_at(whole, face, depth);
        if (trim.lost <= may_lose_ && trim.gain() > best.gain()) best = trim;
      }
      if (best.depth == 0) continue;
      ConvexPolyhedron smaller = below(hull_, {face.normal, face.offset - best.depth});
      if (smaller.dimension() < 3) continue;
      hull_ = std::move(smaller);
      error_ -= best.gain();
      may_lose_ -= best.lost;
    }
    return {std::move(hull_), std::max(0.0, error_)};
  }

 private:
  /// A face moved inwards.
  struct Trim {
    Real depth = 0;    // [m]
    Real removed = 0;  // volume that the trim removes from the hull [m^3]
    Real lost = 0;     // volume of the solid in the removed part [m^3]
    /// Returns the volume by which the difference of hull and solid decreases: the removed empty space minus
    /// the lost part of the solid [m^3].
    Real gain() const { return removed - 2 * lost; }
  };

  Trim trimmed_at(const SolidPiece& whole, const TrimPlane& face, Real depth) const {
    const TrimPlane plane{face.normal, face.offset - depth};
    Trim trim{depth, moments_above(whole, plane).volume};
    for (const SolidPiece* p : pieces_) trim.lost += moments_above(*p, plane).volume;
    return trim;
  }

  /// Returns the extent of the hull along the normal of one of its faces [m].
  Real extent(const TrimPlane& face) const {
    Real depth = 0;
    for (const Vec3& v : hull_.vertices()) depth = std::max(depth, face.offset - face.normal.dot(v));
    return depth;
  }

  /// Returns the planes of the largest faces that the surface of the solid does not cover.
  std::vector<TrimPlane> bridges() const {
    std::vector<std::pair<Real, TrimPlane>> list;
    for (uint32_t f = 0; f < hull_.face_count(); ++f) {
      const auto corners = hull_.face_vertices(f);
      Vec3 sum = Vec3::Zero();
      for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        sum += (hull_.vertex(corners[i]) - hull_.vertex(corners[0]))
                   .cross(hull_.vertex(corners[i + 1]) - hull_.vertex(corners[0]));
      const Real area = sum.norm() / 2;
      if (covered(hull_.plane(f)) < kCovered * area) list.emplace_back(area, hull_.plane(f));
    }
    std::stable_sort(list.begin(), list.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    if (list.size() > kMostTrims) list.resize(kMostTrims);
    std::vector<TrimPlane> planes;
    for (const auto& [area, plane] : list) planes.push_back(plane);
    return planes;
  }

  /// Returns the area of the polygons and caps that lie on a plane [m^2].
  Real covered(const TrimPlane& plane) const {
    Real area = 0;
    const auto on_plane = [&](const Vec3& p) {
      return std::abs(plane.normal.dot(p) - plane.offset) <= on_face_;
    };
    for (const SolidPiece* piece : pieces_) {
      for (std::size_t k = 0; k < piece->polygon_count(); ++k) {
        const auto corner = [&](uint32_t i) -> const Vec3& { return piece->points[piece->corners[i]]; };
        Vec3 sum = Vec3::Zero();
        bool all_on = true;
        for (uint32_t i = piece->first[k]; i < piece->first[k + 1] && all_on; ++i)
          all_on = on_plane(corner(i));
        if (!all_on) continue;
        for (uint32_t i = piece->first[k] + 1; i + 1 < piece->first[k + 1]; ++i)
          sum += (corner(i) - corner(piece->first[k])).cross(corner(i + 1) - corner(piece->first[k]));
        area += sum.norm() / 2;
      }
      for (const SolidPiece::Cap& cap : piece->caps) {
        const Vec3& origin = piece->points[cap.sides.front()[0]];
        if (cap.plane.normal.dot(plane.normal) < 1 - 1e-9 || !on_plane(origin)) continue;
        Vec3 sum = Vec3::Zero();
        for (const auto& [a, b] : cap.sides)
          sum += (piece->points[a] - origin).cross(piece->points[b] - origin);
        area += sum.norm() / 2;
      }
    }
    return area;
  }

  ConvexPolyhedron hull_;
  std::span<const SolidPiece* const> pieces_;
  Real limit_, error_ = 0, on_face_ = 0, may_lose_ = 0;
};

}  // namespace

TrimmedHull trimmed(ConvexPolyhedron hull, std::span<const SolidPiece* const> pieces, Real shared,
                    Real limit) {
  return HullTrimmer(std::move(hull), pieces, shared, limit).run();
}

}  // namespace offstage::sim
