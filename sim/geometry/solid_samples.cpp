#include "sim/geometry/solid_samples.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>

#include "sim/geometry/winding_number.h"

namespace offstage::sim {
namespace {

/// Lower bounds of the mean winding number of the inside: for a solid, and for both sides of a surface
/// together.
constexpr Real kHardlyInside = 0.6, kSurelyInside = 0.9;
/// The lines are shifted by these shares of their distance, so that they miss corners and edges at round
/// numbers.
constexpr Real kShift[] = {0.5137, 0.4781};

/// Lines along `axis` at low + (shift + index) * distance.
struct Lines {
  Aabb box;
  int axis = 2, u = 0, v = 1;
  Real distance = 0;
  int count_u = 0, count_v = 0;

  Lines(const TriangleMesh& mesh, uint32_t resolution) {
    for (const Vec3& p : mesh.vertices) box.extend(p);
    box.sizes().minCoeff(&axis);
    u = (axis + 1) % 3;
    v = (axis + 2) % 3;
    distance = box.sizes().maxCoeff() / resolution;
    count_u = static_cast<int>(std::ceil(box.sizes()[u] / distance));
    count_v = static_cast<int>(std::ceil(box.sizes()[v] / distance));
  }
  Real at_u(int i) const { return box.min()[u] + (kShift[0] + i) * distance; }
  Real at_v(int j) const { return box.min()[v] + (kShift[1] + j) * distance; }
  Vec3 point(int i, int j, Real along) const {
    Vec3 p;
    p[u] = at_u(i);
    p[v] = at_v(j);
    p[axis] = along;
    return p;
  }
};

struct Crossing {
  int line;
  Real along;
  int step;  // change of the winding number
  bool operator<(const Crossing& c) const {
    return line != c.line ? line < c.line : along != c.along ? along < c.along : step > c.step;
  }
};

/// Twice the signed area of the triangle (a, b, p), with the same magnitude for (b, a, p).
Real side(const Vec3& a, const Vec3& b, uint32_t ia, uint32_t ib, Real pu, Real pv, const Lines& l) {
  if (ia > ib) return -side(b, a, ib, ia, pu, pv, l);
  return (b[l.u] - a[l.u]) * (pv - a[l.v]) - (b[l.v] - a[l.v]) * (pu - a[l.u]);
}

void add_crossings(const TriangleMesh& mesh, const Triangle& t, const Lines& l, std::vector<Crossing>& out) {
  const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  const Vec3 normal = (b - a).cross(c - a);
  if (normal[l.axis] == 0) return;
  const auto range = [&](int axis, Real shift, int count) {
    const auto [low, high] = std::minmax({a[axis], b[axis], c[axis]});
    const auto index = [&](Real x) { return (x - l.box.min()[axis]) / l.distance - shift; };
    return std::pair(std::clamp(static_cast<int>(std::ceil(index(low) - 1e-9)), 0, count),
                     std::clamp(static_cast<int>(std::floor(index(high) + 1e-9)) + 1, 0, count));
  };
  const auto [u0, u1] = range(l.u, kShift[0], l.count_u);
  const auto [v0, v1] = range(l.v, kShift[1], l.count_v);
  const bool up = normal[l.axis] > 0;
  for (int j = v0; j < v1; ++j)
    for (int i = u0; i < u1; ++i) {
      const Real pu = l.at_u(i), pv = l.at_v(j);
      const Real ab = side(a, b, t[0], t[1], pu, pv, l), bc = side(b, c, t[1], t[2], pu, pv, l),
                 ca = side(c, a, t[2], t[0], pu, pv, l);
      // An edge belongs to one of its two triangles: its sign is the same in both, up to direction.
      if (up ? (ab < 0 || bc < 0 || ca < 0) : (ab >= 0 || bc >= 0 || ca >= 0)) continue;
      const Real along =
          a[l.axis] - (normal[l.u] * (pu - a[l.u]) + normal[l.v] * (pv - a[l.v])) / normal[l.axis];
      out.push_back({i + l.count_u * j, along, up ? -1 : 1});
    }
}

SolidSamples sample_closed(const TriangleMesh& mesh, const Lines& l) {
  std::vector<Crossing> crossings;
  for (const Triangle& t : mesh.triangles) add_crossings(mesh, t, l, crossings);
  std::sort(crossings.begin(), crossings.end());
  SolidSamples samples{.segments = {}, .line_area = l.distance * l.distance};
  for (std::size_t first = 0; first < crossings.size();) {
    const int line = crossings[first].line;
    std::size_t end = first;
    int winding = 0;
    for (; end < crossings.size() && crossings[end].line == line; ++end) winding += crossings[end].step;
    // A line along an edge may miss a triangle; it is then left out.
    int now = 0;
    Real start = 0;
    for (std::size_t k = first; winding == 0 && k < end; ++k) {
      const int before = std::exchange(now, now + crossings[k].step);
      samples.overlaps |= now > 1;
      if (before <= 0 && now > 0) start = crossings[k].along;
      if (before > 0 && now <= 0 && crossings[k].along > start)
        samples.segments.push_back({l.point(line % l.count_u, line / l.count_u, start),
                                    l.point(line % l.count_u, line / l.count_u, crossings[k].along)});
    }
    first = end;
  }
  return samples;
}

/// A solid has winding numbers near 1 inside, or -1 if its surface is inside out. Near an open sheet they are
/// just over 1/2 on hollow sides, possibly on both.
SolidSamples sample_open(const TriangleMesh& mesh, const Lines& l) {
  struct Row {
    Real positive = 0, negative = 0;
    int count = 0;
    std::vector<SolidSamples::Segment> segments;
  };
  const WindingNumber winding(mesh);
  const int depth = static_cast<int>(std::ceil(l.box.sizes()[l.axis] / l.distance));
  std::vector<Row> rows(static_cast<std::size_t>(l.count_v));
  tbb::parallel_for(0, l.count_v, [&](int j) {
    Row& row = rows[static_cast<std::size_t>(j)];
    for (int i = 0; i < l.count_u; ++i) {
      int start = -1;
      for (int k = 0; k <= depth; ++k) {
        const auto along = [&](Real at) { return l.box.min()[l.axis] + at * l.distance; };
        const Real w = k < depth ? winding.at(l.point(i, j, along(k + 0.5))) : 0;
        const bool inside = std::abs(w) > 0.5;
        if (inside) {
          (w > 0 ? row.positive : row.negative) += std::abs(w);
          ++row.count;
          if (start < 0) start = k;
        } else if (start >= 0) {
          row.segments.push_back({l.point(i, j, along(start)), l.point(i, j, along(k))});
          start = -1;
        }
      }
    }
  });
  Real positive = 0, negative = 0;
  int count = 0;
  SolidSamples samples{.segments = {}, .line_area = l.distance * l.distance};
  for (const Row& row : rows) {
    positive += row.positive;
    negative += row.negative;
    count += row.count;
    samples.segments.insert(samples.segments.end(), row.segments.begin(), row.segments.end());
  }
  const auto [less, more] = std::minmax(positive, negative);
  if (less + more < (less > more / 4 ? kSurelyInside : kHardlyInside) * count) samples.segments.clear();
  return samples;
}

}  // namespace

Real SolidSamples::volume() const {
  Real length = 0;
  for (const Segment& s : segments) length += (s.high - s.low).norm();
  return line_area * length;
}

SolidSamples sample_solid(const TriangleMesh& mesh, bool is_closed, uint32_t resolution) {
  const Lines lines(mesh, is_closed ? resolution : (resolution + 1) / 2);
  if (lines.box.isEmpty() || !(lines.distance > 0)) return {};
  return is_closed ? sample_closed(mesh, lines) : sample_open(mesh, lines);
}

}  // namespace offstage::sim
