#include "sim/geometry/solid_piece.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>
#include <utility>

namespace offstage::sim {
namespace {

using Side = SolidPiece::Side;
using CutBy = SolidPiece::Plane;

constexpr uint32_t kUnset = 0xffffffff;

uint64_t side_key(uint32_t a, uint32_t b) {
  return (uint64_t{a} << 32) | b;
}

Vec3 middle_of(const SolidPiece& piece) {
  Aabb box;
  for (const Vec3& p : piece.points) box.extend(p);
  return piece.points.empty() ? Vec3::Zero() : Vec3(box.center());
}

/// Calls f(begin, end) with the range of corners of every polygon.
template <class F>
void for_each_polygon(const SolidPiece& piece, F&& f) {
  for (std::size_t k = 0; k < piece.polygon_count(); ++k) f(piece.first[k], piece.first[k + 1]);
}

uint32_t corner_after(const SolidPiece& piece, uint32_t begin, uint32_t end, uint32_t i) {
  return piece.corners[i + 1 < end ? i + 1 : begin];
}

/// One half of a cut, under construction.
class HalfBuilder {
 public:
  /// `points`: the points of the whole piece and the crossings; corners are indices of these points.
  explicit HalfBuilder(const std::vector<Vec3>& points) : points_(points) {}

  void add_polygon(const std::vector<uint32_t>& polygon) {
    std::vector<uint32_t> distinct;
    for (uint32_t v : polygon)
      if (distinct.empty() || distinct.back() != v) distinct.push_back(v);
    while (distinct.size() > 1 && distinct.back() == distinct.front()) distinct.pop_back();
    // A polygon with two corners left is an edge and its reverse, which cancel.
    if (distinct.size() < 3) return;
    for (std::size_t i = 0; i < distinct.size(); ++i) count(distinct[i], distinct[(i + 1) % distinct.size()]);
    half_.corners.insert(half_.corners.end(), distinct.begin(), distinct.end());
    half_.first.push_back(static_cast<uint32_t>(half_.corners.size()));
  }

  void add_cap(SolidPiece::Cap cap) {
    std::erase_if(cap.sides, [](const Side& s) { return s[0] == s[1]; });
    if (cap.sides.empty()) return;
    for (const Side& s : cap.sides) count(s[0], s[1]);
    half_.caps.push_back(std::move(cap));
  }

  /// Closes the surface on the cut plane, and removes unused points.
  SolidPiece finish(const CutBy& outward) {
    SolidPiece::Cap cap{outward, {}};
    // The edges are visited in the order of their keys, so that the result does not depend on the hash table.
    std::vector<std::pair<uint64_t, int>> open(net_.begin(), net_.end());
    std::sort(open.begin(), open.end());
    for (const auto& [key, net] : open) {
      const auto a = static_cast<uint32_t>(key >> 32), b = static_cast<uint32_t>(key);
      for (int k = 0; k < std::abs(net); ++k) cap.sides.push_back(net > 0 ? Side{b, a} : Side{a, b});
    }
    if (!cap.sides.empty()) half_.caps.push_back(std::move(cap));
    compact();
    return std::move(half_);
  }

 private:
  /// Counts an edge; an edge and its reverse cancel.
  void count(uint32_t a, uint32_t b) { net_[side_key(std::min(a, b), std::max(a, b))] += a < b ? 1 : -1; }

  void compact() {
    std::vector<uint32_t> place(points_.size(), kUnset);
    const auto moved = [&](uint32_t v) {
      if (place[v] == kUnset) {
        place[v] = static_cast<uint32_t>(half_.points.size());
        half_.points.push_back(points_[v]);
      }
      return place[v];
    };
    for (uint32_t& v : half_.corners) v = moved(v);
    for (SolidPiece::Cap& cap : half_.caps)
      for (Side& s : cap.sides) s = {moved(s[0]), moved(s[1])};
  }

  const std::vector<Vec3>& points_;
  SolidPiece half_;
  std::unordered_map<uint64_t, int> net_;
};

class PieceCutter {
 public:
  PieceCutter(const SolidPiece& piece, const CutBy& plane, Real tolerance)
      : piece_(piece), plane_(plane), points_(piece.points) {
    height_.reserve(points_.size());
    for (const Vec3& p : points_) {
      const Real h = plane.normal.dot(p) - plane.offset;
      height_.push_back(std::abs(h) <= tolerance ? 0 : h);
    }
  }

  std::array<SolidPiece, 2> run() {
    find_crossings();
    HalfBuilder above(points_), below(points_);
    for_each_polygon(piece_, [&](uint32_t begin, uint32_t end) { clip(begin, end, above, below); });
    for (const SolidPiece::Cap& cap : piece_.caps) {
      above.add_cap(clipped(cap, 1));
      below.add_cap(clipped(cap, -1));
    }
    return {above.finish({-plane_.normal, -plane_.offset}), below.finish(plane_)};
  }

 private:
  bool crosses(uint32_t a, uint32_t b) const {
    return (height_[a] > 0 && height_[b] < 0) || (height_[a] < 0 && height_[b] > 0);
  }

  void find_crossings() {
    for_each_polygon(piece_, [&](uint32_t begin, uint32_t end) {
      for (uint32_t i = begin; i < end; ++i)
        find_crossing(piece_.corners[i], corner_after(piece_, begin, end, i));
    });
    for (const SolidPiece::Cap& cap : piece_.caps)
      for (const Side& s : cap.sides) find_crossing(s[0], s[1]);
  }

  void find_crossing(uint32_t a, uint32_t b) {
    if (!crosses(a, b)) return;
    if (a > b) std::swap(a, b);
    const auto [entry, is_new] = crossing_.try_emplace(side_key(a, b), static_cast<uint32_t>(points_.size()));
    if (!is_new) return;
    points_.push_back(points_[a] + height_[a] / (height_[a] - height_[b]) * (points_[b] - points_[a]));
    height_.push_back(0);
  }

  uint32_t crossing(uint32_t a, uint32_t b) const {
    return crossing_.at(side_key(std::min(a, b), std::max(a, b)));
  }

  void clip(uint32_t begin, uint32_t end, HalfBuilder& above, HalfBuilder& below) const {
    Real lowest = 0, highest = 0;
    for (uint32_t i = begin; i < end; ++i) {
      lowest = std::min(lowest, height_[piece_.corners[i]]);
      highest = std::max(highest, height_[piece_.corners[i]]);
    }
    if (lowest == 0 && highest == 0) {
      // The solid is on the side from which the normal of the polygon points away.
      (outward(begin, end).dot(plane_.normal) > 0 ? below : above)
          .add_polygon({piece_.corners.begin() + begin, piece_.corners.begin() + end});
      return;
    }
    if (highest > 0) above.add_polygon(clipped(begin, end, 1));
    if (lowest < 0) below.add_polygon(clipped(begin, end, -1));
  }

  std::vector<uint32_t> clipped(uint32_t begin, uint32_t end, Real sign) const {
    std::vector<uint32_t> polygon;
    for (uint32_t i = begin; i < end; ++i) {
      const uint32_t a = piece_.corners[i], b = corner_after(piece_, begin, end, i);
      if (sign * height_[a] >= 0) polygon.push_back(a);
      if (crosses(a, b)) polygon.push_back(crossing(a, b));
    }
    return polygon;
  }

  Vec3 outward(uint32_t begin, uint32_t end) const {
    Vec3 sum = Vec3::Zero();
    const Vec3& origin = points_[piece_.corners[begin]];
    for (uint32_t i = begin + 1; i + 1 < end; ++i)
      sum += (points_[piece_.corners[i]] - origin).cross(points_[piece_.corners[i + 1]] - origin);
    return sum;
  }

  /// Returns the part of a cap on one side of the cut plane. Its outline must be closed along the line where
  /// both planes meet. A sweep along the line counts how often the outline encloses each interval, and adds
  /// sides where the cap is.
  SolidPiece::Cap clipped(const SolidPiece::Cap& cap, Real sign) const {
    SolidPiece::Cap part{cap.plane, {}};
    std::map<uint32_t, int> ends;  // by point: sides that end there minus sides that begin
    for (const auto& [a, b] : cap.sides) {
      const Real ha = sign * height_[a], hb = sign * height_[b];
      if (ha <= 0 && hb <= 0) continue;
      const uint32_t from = ha < 0 ? crossing(a, b) : a, to = hb < 0 ? crossing(a, b) : b;
      part.sides.push_back({from, to});
      if (ha <= 0) --ends[from];
      if (hb <= 0) ++ends[to];
    }
    close(ends, cap.plane.normal.cross(plane_.normal), part.sides);
    return part;
  }

  void close(const std::map<uint32_t, int>& ends, const Vec3& along, std::vector<Side>& sides) const {
    std::vector<std::pair<Real, uint32_t>> events;
    for (const auto& [v, net] : ends)
      if (net != 0) events.emplace_back(along.dot(points_[v]), v);
    std::sort(events.begin(), events.end());
    int covered = 0;
    for (std::size_t k = 0; k + 1 < events.size(); ++k) {
      const uint32_t v = events[k].second, next = events[k + 1].second;
      covered += ends.at(v);
      for (int n = 0; n < std::abs(covered); ++n)
        sides.push_back(covered > 0 ? Side{v, next} : Side{next, v});
    }
  }

  const SolidPiece& piece_;
  CutBy plane_;
  std::vector<Vec3> points_;  // points of the piece, then the crossings
  std::vector<Real> height_;  // by point: height over the plane, 0 within the tolerance
  std::unordered_map<uint64_t, uint32_t> crossing_;
};

/// Sums the signed tetrahedra between an apex and triangles. Coordinates are relative to the apex.
struct PyramidSum {
  Real volume6 = 0;
  Vec3 first24 = Vec3::Zero();

  void add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Real v = a.dot(b.cross(c));
    volume6 += v;
    first24 += v * (a + b + c);
  }
  PieceMoments about_origin(const Vec3& apex) const {
    return {volume6 / 6, first24 / 24 + volume6 / 6 * apex};
  }
};

/// Adds the polygons above a plane; the apex is on the plane.
void add_polygons_above(const SolidPiece& piece, const std::vector<Real>& height, const Vec3& apex,
                        PyramidSum& sum) {
  for_each_polygon(piece, [&](uint32_t begin, uint32_t end) {
    Vec3 origin, previous;
    int count = 0;
    const auto add = [&](const Vec3& p) {
      if (count == 0) origin = p;
      if (count > 1) sum.add(origin, previous, p);
      previous = p;
      ++count;
    };
    for (uint32_t i = begin; i < end; ++i) {
      const uint32_t a = piece.corners[i], b = corner_after(piece, begin, end, i);
      if (height[a] >= 0) add(piece.points[a] - apex);
      if ((height[a] > 0 && height[b] < 0) || (height[a] < 0 && height[b] > 0))
        add(piece.points[a] - apex +
            height[a] / (height[a] - height[b]) * (piece.points[b] - piece.points[a]));
    }
  });
}

void add_cap_above(const SolidPiece& piece, const SolidPiece::Cap& cap, const CutBy& plane,
                   const std::vector<Real>& height, const Vec3& apex, PyramidSum& sum) {
  if (cap.sides.empty()) return;
  const Vec3 across = plane.normal - plane.normal.dot(cap.plane.normal) * cap.plane.normal;
  // The triangles of the cap start at a corner on the line where the two planes meet, so that the closing
  // sides along this line contribute nothing. Parallel planes do not meet; the cap is then on one side of the
  // plane.
  const uint32_t any = cap.sides.front()[0];
  Vec3 corner = piece.points[any] - apex;
  if (const Real square = across.squaredNorm(); square > 1e-20) corner -= height[any] / square * across;
  for (const auto& [a, b] : cap.sides) {
    if (height[a] <= 0 && height[b] <= 0) continue;
    Vec3 from = piece.points[a] - apex, to = piece.points[b] - apex;
    const Vec3 middle = from + height[a] / (height[a] - height[b]) * (to - from);
    if (height[a] < 0) from = middle;
    if (height[b] < 0) to = middle;
    sum.add(corner, from, to);
  }
}

}  // namespace

SolidPiece solid_piece(const TriangleMesh& mesh) {
  SolidPiece piece;
  piece.points = mesh.vertices;
  for (const Triangle& t : mesh.triangles) {
    piece.corners.insert(piece.corners.end(), t.begin(), t.end());
    piece.first.push_back(static_cast<uint32_t>(piece.corners.size()));
  }
  return piece;
}

SolidPiece solid_piece(const ConvexPolyhedron& polyhedron) {
  SolidPiece piece;
  piece.points.assign(polyhedron.vertices().begin(), polyhedron.vertices().end());
  for (uint32_t f = 0; f < polyhedron.face_count(); ++f) {
    const auto face = polyhedron.face_vertices(f);
    piece.corners.insert(piece.corners.end(), face.begin(), face.end());
    piece.first.push_back(static_cast<uint32_t>(piece.corners.size()));
  }
  return piece;
}

PieceMoments moments(const SolidPiece& piece) {
  const Vec3 apex = middle_of(piece);
  PyramidSum sum;
  for_each_polygon(piece, [&](uint32_t begin, uint32_t end) {
    const Vec3 origin = piece.points[piece.corners[begin]] - apex;
    for (uint32_t i = begin + 1; i + 1 < end; ++i)
      sum.add(origin, piece.points[piece.corners[i]] - apex, piece.points[piece.corners[i + 1]] - apex);
  });
  for (const SolidPiece::Cap& cap : piece.caps) {
    const Vec3 corner = piece.points[cap.sides.front()[0]] - apex;
    for (const auto& [a, b] : cap.sides) sum.add(corner, piece.points[a] - apex, piece.points[b] - apex);
  }
  return sum.about_origin(apex);
}

PieceMoments moments_above(const SolidPiece& piece, const CutBy& plane) {
  std::vector<Real> height;
  height.reserve(piece.points.size());
  bool any_above = false, any_below = false;
  for (const Vec3& p : piece.points) {
    height.push_back(plane.normal.dot(p) - plane.offset);
    any_above |= height.back() > 0;
    any_below |= height.back() < 0;
  }
  if (!any_above) return {};
  if (!any_below) return moments(piece);
  const Vec3 middle = middle_of(piece);
  const Vec3 apex = middle - (plane.normal.dot(middle) - plane.offset) * plane.normal;
  PyramidSum sum;
  add_polygons_above(piece, height, apex, sum);
  for (const SolidPiece::Cap& cap : piece.caps) add_cap_above(piece, cap, plane, height, apex, sum);
  return sum.about_origin(apex);
}

std::array<SolidPiece, 2> cut(const SolidPiece& piece, const CutBy& plane, Real tolerance) {
  return PieceCutter(piece, plane, tolerance).run();
}

std::vector<Side> edges(const SolidPiece& piece) {
  std::vector<Side> list;
  const auto add = [&](uint32_t a, uint32_t b) { list.push_back({std::min(a, b), std::max(a, b)}); };
  for_each_polygon(piece, [&](uint32_t begin, uint32_t end) {
    for (uint32_t i = begin; i < end; ++i) add(piece.corners[i], corner_after(piece, begin, end, i));
  });
  for (const SolidPiece::Cap& cap : piece.caps)
    for (const Side& s : cap.sides) add(s[0], s[1]);
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

}  // namespace offstage::sim
