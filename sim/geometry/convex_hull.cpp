#include "sim/geometry/convex_hull.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace offstage::sim {
namespace {

constexpr Real kFlat = 1e-9;       // fraction of the extent: thinner sets count as flat
constexpr Real kCoplanar = 1e-10;  // fraction of the extent: points nearer to a face's plane count as on it

using Loops = std::vector<std::vector<uint32_t>>;

/// The state of Qhull. The destructor frees it in all cases. Messages of Qhull go to a temporary file, which
/// is discarded.
class Qhull {
 public:
  Qhull() : log_(std::tmpfile()) { qh_zero(&qh_, log_); }
  ~Qhull() {
    qh_freeqhull(&qh_, !qh_ALL);
    int long_blocks = 0, long_bytes = 0;
    qh_memfreeshort(&qh_, &long_blocks, &long_bytes);
    if (log_) std::fclose(log_);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;

  /// Returns the triangles of the hull, counter-clockwise from outside; empty if Qhull fails.
  std::vector<Triangle> triangles(std::vector<Real>& coordinates, const char* command) {
    const int count = static_cast<int>(coordinates.size() / 3);
    std::vector<char> text(command, command + std::char_traits<char>::length(command) + 1);
    std::vector<Triangle> result;
    if (qh_new_qhull(&qh_, 3, count, coordinates.data(), 0, text.data(), nullptr, log_) != 0) return result;
    for (facetT* f = qh_.facet_list; f && f->next; f = f->next) {
      Triangle t;
      for (int k = 0; k < 3; ++k)
        t[static_cast<std::size_t>(k)] =
            static_cast<uint32_t>(qh_pointid(&qh_, static_cast<vertexT*>(f->vertices->e[k].p)->point));
      if (f->toporient != qh_ORIENTclock) std::swap(t[1], t[2]);
      result.push_back(t);
    }
    return result;
  }

 private:
  qhT qh_;
  std::FILE* log_;
};

/// A line or plane through extreme points of a set. It is computed without sums over the points, so distant
/// and repeated points do not reduce the accuracy.
struct Frame {
  int dimension;  // dimension of the set: 0 to 3
  Vec3 origin, along, normal;
  Real extent;
};

Frame fit(std::span<const Vec3> points) {
  const auto farthest = [&](auto&& measure) {
    std::size_t best = 0;
    Real most = -1;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (const Real m = measure(points[i]); m > most) {
        most = m;
        best = i;
      }
    return std::pair(points[best], most);
  };
  const Vec3 start = points.front();
  const Vec3 a = farthest([&](const Vec3& p) { return (p - start).squaredNorm(); }).first;
  const auto [b, length2] = farthest([&](const Vec3& p) { return (p - a).squaredNorm(); });
  const Real extent = std::sqrt(length2);
  Frame frame{0, a, Vec3::UnitX(), Vec3::UnitY(), extent};
  if (extent == 0) return frame;

  frame.along = (b - a) / extent;
  const auto across = [&](const Vec3& p) { return Vec3(p - a - frame.along.dot(p - a) * frame.along); };
  const auto [c, width2] = farthest([&](const Vec3& p) { return across(p).squaredNorm(); });
  frame.dimension = 1;
  if (std::sqrt(width2) <= kFlat * extent) return frame;

  frame.normal = frame.along.cross(across(c)).normalized();
  const Real thickness = farthest([&](const Vec3& p) { return std::abs(frame.normal.dot(p - a)); }).second;
  frame.dimension = thickness <= kFlat * extent ? 2 : 3;
  return frame;
}

ConvexPolyhedron segment_hull(std::span<const Vec3> points, const Frame& frame) {
  const auto [low, high] = std::minmax_element(
      points.begin(), points.end(),
      [&](const Vec3& p, const Vec3& q) { return frame.along.dot(p) < frame.along.dot(q); });
  return {{*low, *high}, {}};
}

/// Returns the hull of a flat set by Andrew's monotone chain. It has two faces, one for each side.
ConvexPolyhedron polygon_hull(std::span<const Vec3> points, const Frame& frame) {
  const Vec3 across = frame.normal.cross(frame.along);
  struct Flat {
    Real x, y;
    uint32_t index;
  };
  std::vector<Flat> flat;
  for (uint32_t i = 0; i < points.size(); ++i)
    flat.push_back({frame.along.dot(points[i] - frame.origin), across.dot(points[i] - frame.origin), i});
  std::sort(flat.begin(), flat.end(), [](const Flat& p, const Flat& q) {
    return std::tie(p.x, p.y, p.index) < std::tie(q.x, q.y, q.index);
  });
  const Real least_area = kCoplanar * frame.extent * frame.extent;
  std::vector<Flat> chain;
  const auto add = [&](const Flat& p, std::size_t keep) {
    while (chain.size() > keep) {
      const Flat &o = chain[chain.size() - 2], &m = chain.back();
      if ((m.x - o.x) * (p.y - o.y) - (m.y - o.y) * (p.x - o.x) > least_area) break;
      chain.pop_back();
    }
    chain.push_back(p);
  };
  for (const Flat& p : flat) add(p, 1);
  const std::size_t lower = chain.size();
  for (auto p = flat.rbegin() + 1; p != flat.rend(); ++p) add(*p, lower);
  chain.pop_back();
  if (chain.size() < 3) return segment_hull(points, frame);

  std::vector<Vec3> vertices;
  Loops faces(2);
  for (const Flat& p : chain) {
    faces[0].push_back(static_cast<uint32_t>(vertices.size()));
    vertices.push_back(points[p.index]);
  }
  faces[1].assign(faces[0].rbegin(), faces[0].rend());
  return {std::move(vertices), faces};
}

/// Merges triangles that lie in one plane into polygons and removes the vertices inside them.
class FaceMerger {
 public:
  FaceMerger(std::span<const Vec3> points, const std::vector<Triangle>& triangles, Real tolerance)
      : points_(points), triangles_(triangles), tolerance_(tolerance), group_(triangles.size(), kNoFace) {}

  /// Returns the polygons as indices of points; empty if some group has no single outline.
  Loops faces() {
    find_neighbours();
    std::vector<uint32_t> by_area(triangles_.size());
    std::iota(by_area.begin(), by_area.end(), 0u);
    std::stable_sort(by_area.begin(), by_area.end(),
                     [&](uint32_t s, uint32_t t) { return area(s).squaredNorm() > area(t).squaredNorm(); });
    uint32_t groups = 0;
    for (uint32_t t : by_area)
      if (group_[t] == kNoFace) gather(t, groups++);
    Loops loops;
    for (uint32_t g = 0; g < groups; ++g) {
      loops.push_back(outline(g));
      if (loops.back().size() < 3) return {};
    }
    drop_straight_vertices(loops);
    return loops;
  }

 private:
  const Vec3& corner(uint32_t t, std::size_t k) const { return points_[triangles_[t][k % 3]]; }
  Vec3 area(uint32_t t) const { return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)) / 2; }

  void find_neighbours() {
    std::vector<std::array<uint32_t, 4>> sides;  // low, high, triangle, side
    for (uint32_t t = 0; t < triangles_.size(); ++t)
      for (uint32_t k = 0; k < 3; ++k) {
        const uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
        sides.push_back({std::min(a, b), std::max(a, b), t, k});
      }
    std::sort(sides.begin(), sides.end());
    neighbours_.assign(triangles_.size(), {kNoFace, kNoFace, kNoFace});
    for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
      const auto &s = sides[i], &t = sides[i + 1];
      if (s[0] != t[0] || s[1] != t[1]) continue;
      neighbours_[s[2]][s[3]] = t[2];
      neighbours_[t[2]][t[3]] = s[2];
    }
  }

  /// Collects a group by a flood fill from a triangle over neighbours in the same plane.
  void gather(uint32_t seed, uint32_t group) {
    const Vec3 normal = area(seed).normalized();
    const Real offset = normal.dot(corner(seed, 0));
    members_.push_back({seed});
    group_[seed] = group;
    for (std::size_t i = 0; i < members_.back().size(); ++i)
      for (uint32_t next : neighbours_[members_.back()[i]]) {
        if (next == kNoFace || group_[next] != kNoFace) continue;
        bool flat = true;
        for (std::size_t k = 0; k < 3; ++k)
          flat &= std::abs(normal.dot(corner(next, k)) - offset) <= tolerance_;
        // A sliver lies in every plane through its long side; one that faces away belongs to another group.
        if (!flat || normal.dot(area(next)) < 0) continue;
        group_[next] = group;
        members_.back().push_back(next);
      }
  }

  /// Returns the boundary of a group as one loop; empty if there are several.
  std::vector<uint32_t> outline(uint32_t group) const {
    std::vector<std::pair<uint32_t, uint32_t>> sides;
    for (uint32_t t : members_[group])
      for (std::size_t k = 0; k < 3; ++k)
        if (neighbours_[t][k] == kNoFace || group_[neighbours_[t][k]] != group)
          sides.emplace_back(triangles_[t][k], triangles_[t][(k + 1) % 3]);
    if (sides.empty()) return {};  // a closed surface in one plane: the points are degenerate
    std::sort(sides.begin(), sides.end());
    std::vector<uint32_t> loop;
    uint32_t at = sides.front().first;
    do {
      loop.push_back(at);
      const auto side = std::lower_bound(sides.begin(), sides.end(), std::pair(at, 0u));
      if (side == sides.end() || side->first != at || loop.size() > sides.size()) return {};
      at = side->second;
    } while (at != loop.front());
    return loop.size() == sides.size() ? loop : std::vector<uint32_t>{};
  }

  /// Removes vertices that belong to only two polygons. They lie inside a straight edge.
  void drop_straight_vertices(Loops& loops) const {
    std::vector<uint32_t> uses(points_.size(), 0);
    for (const auto& loop : loops)
      for (uint32_t v : loop) ++uses[v];
    for (auto& loop : loops) {
      std::erase_if(loop, [&](uint32_t v) { return uses[v] < 3; });
    }
    std::erase_if(loops, [](const auto& loop) { return loop.size() < 3; });
  }

  std::span<const Vec3> points_;
  const std::vector<Triangle>& triangles_;
  Real tolerance_;
  std::vector<std::array<uint32_t, 3>> neighbours_;
  std::vector<uint32_t> group_;
  std::vector<std::vector<uint32_t>> members_;
};

/// Builds a polyhedron from the vertices that the faces use. The order of the points is kept.
ConvexPolyhedron compact(std::span<const Vec3> points, Loops faces) {
  std::vector<uint32_t> place(points.size(), kNoFace);
  for (const auto& face : faces)
    for (uint32_t v : face) place[v] = 0;
  std::vector<Vec3> vertices;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (place[i] == 0) {
      place[i] = static_cast<uint32_t>(vertices.size());
      vertices.push_back(points[i]);
    }
  for (auto& face : faces)
    for (uint32_t& v : face) v = place[v];
  return {std::move(vertices), faces};
}

/// Builds the polyhedron of a triangulated hull with merged faces or, if merging does not give a closed
/// surface, with the triangles as they are. Returns an empty polyhedron if the triangles do not give a closed
/// surface either.
ConvexPolyhedron assemble(std::span<const Vec3> points, const std::vector<Triangle>& triangles,
                          Real tolerance) {
  try {
    if (Loops faces = FaceMerger(points, triangles, tolerance).faces(); faces.size() >= 4)
      return compact(points, std::move(faces));
  } catch (const std::invalid_argument&) {
    // A merged outline touches itself. The triangles are used instead; their outlines never touch themselves.
  }
  Loops faces;
  for (const Triangle& t : triangles) faces.push_back({t[0], t[1], t[2]});
  try {
    return compact(points, std::move(faces));
  } catch (const std::invalid_argument&) {
    return {};
  }
}

/// Returns the power of two that scales the largest coordinate to about 1 if products of four coordinates
/// would overflow or underflow; else 0.
int exponent_to_one(std::span<const Vec3> points) {
  constexpr int kMost = 200;
  Real largest = 0;
  for (const Vec3& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  const int exponent = largest > 0 && std::isfinite(largest) ? std::ilogb(largest) : 0;
  return std::abs(exponent) > kMost ? -exponent : 0;
}

std::vector<Vec3> scaled_by_power(std::span<const Vec3> points, int exponent) {
  std::vector<Vec3> scaled(points.begin(), points.end());
  for (Vec3& p : scaled) p = p.unaryExpr([&](Real x) { return std::ldexp(x, exponent); });
  return scaled;
}

}  // namespace

ConvexPolyhedron convex_hull(std::span<const Vec3> points) {
  assert(!points.empty());
  if (const int exponent = exponent_to_one(points); exponent != 0) {
    const ConvexPolyhedron unit = convex_hull(scaled_by_power(points, exponent));
    Loops faces(unit.face_count());
    for (uint32_t f = 0; f < unit.face_count(); ++f)
      faces[f].assign(unit.face_vertices(f).begin(), unit.face_vertices(f).end());
    return {scaled_by_power(unit.vertices(), -exponent), faces};
  }
  const Frame frame = fit(points);
  if (frame.dimension == 0) return {{points.front()}, {}};
  if (frame.dimension == 1) return segment_hull(points, frame);
  if (frame.dimension == 2) return polygon_hull(points, frame);

  // Qhull's tolerances grow with the coordinates: it works on the set moved to the origin and scaled to
  // size 1.
  std::vector<Real> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vec3& p : points)
    for (int k = 0; k < 3; ++k) coordinates.push_back((p[k] - frame.origin[k]) / frame.extent);
  // The option Qt gives triangles only. The option QJ is the last resort: it perturbs the input, so that no
  // two faces are exactly coplanar.
  for (const char* command : {"qhull Qt Pp", "qhull QJ Pp"}) {
    std::vector<Real> copy = coordinates;
    const std::vector<Triangle> triangles = Qhull().triangles(copy, command);
    if (triangles.size() < 4) continue;
    if (ConvexPolyhedron hull = assemble(points, triangles, kCoplanar * frame.extent); hull.face_count() >= 4)
      return hull;
  }
  return polygon_hull(points, frame);  // too thin for Qhull: its projection is used
}

}  // namespace offstage::sim
