#include "sim/geometry/polyhedron.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "sim/geometry/polygon.h"

namespace offstage::sim {
namespace {

using FacePlane = Polyhedron::Plane;

constexpr uint32_t kNone = 0xffffffff;

Vec3 doubled_area_of(const TriangleMesh& mesh, uint32_t face) {
  const Triangle& t = mesh.triangles[face];
  const Vec3& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

/// Returns the smallest height of a triangle [m].
Real thickness(const TriangleMesh& mesh, uint32_t face, Real area2) {
  const Triangle& t = mesh.triangles[face];
  Real longest = 0;
  for (std::size_t k = 0; k < 3; ++k)
    longest = std::max(longest, (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
  return longest > 0 ? area2 / longest : 0;
}

/// Connected regions of triangles that lie in one plane.
struct FlatRegions {
  std::vector<FacePlane> planes;               // plane of each region
  std::vector<std::vector<uint32_t>> members;  // triangles of each region, in their order
  std::vector<uint32_t> region;                // region of each triangle
};

/// Divides the triangles into connected regions that lie in one plane. Planes grow from the largest
/// triangles, whose normals are the most accurate. Slivers have no reliable normal and take the plane of
/// their neighbours.
FlatRegions flat_regions(const TriangleMesh& mesh, const MeshTopology& topology, Real tolerance) {
  const auto n = static_cast<uint32_t>(mesh.triangles.size());
  std::vector<Real> area(n);
  for (uint32_t f = 0; f < n; ++f) area[f] = doubled_area_of(mesh, f).norm();
  std::vector<uint32_t> seeds(n);
  std::iota(seeds.begin(), seeds.end(), 0u);
  std::stable_sort(seeds.begin(), seeds.end(), [&](uint32_t a, uint32_t b) { return area[a] > area[b]; });

  FlatRegions regions;
  regions.region.assign(n, kNone);
  std::vector<bool> done(n, false);
  const auto lies_in = [&](uint32_t f, const FacePlane& plane) {
    for (uint32_t v : mesh.triangles[f])
      if (std::abs(plane.normal.dot(mesh.vertices[v]) - plane.offset) > tolerance) return false;
    return topology.face_normal(f).dot(plane.normal) > 0.5 || thickness(mesh, f, area[f]) <= tolerance;
  };
  std::vector<uint32_t> front;
  for (uint32_t seed : seeds) {
    if (done[seed]) continue;
    const Vec3& normal = topology.face_normal(seed);
    const FacePlane plane{normal, normal.dot(mesh.vertices[mesh.triangles[seed][0]])};
    const auto region = static_cast<uint32_t>(regions.planes.size());
    regions.planes.push_back(plane);
    done[seed] = true;
    front = {seed};
    while (!front.empty()) {
      const uint32_t f = front.back();
      front.pop_back();
      regions.region[f] = region;
      for (uint32_t g : topology.face_neighbours(f)) {
        if (g == kNoFace || done[g] || !lies_in(g, plane)) continue;
        done[g] = true;
        front.push_back(g);
      }
    }
  }
  regions.members.resize(regions.planes.size());
  for (uint32_t f = 0; f < n; ++f)
    if (topology.face_edges(f)[0] != kNoFace) regions.members[regions.region[f]].push_back(f);
  return regions;
}

/// A side of a polygon: a vertex, and the mesh's edge from it to the next vertex. The edge is kNone for a new
/// diagonal.
struct PolygonSide {
  uint32_t from, edge;
};
using Polygon = std::vector<PolygonSide>;

/// Returns the outline of a region; empty if the region has holes or its outline touches itself.
Polygon outline_of(const TriangleMesh& mesh, const MeshTopology& topology, const FlatRegions& regions,
                   uint32_t region) {
  struct Outward {
    uint32_t to, edge;
  };
  std::map<uint32_t, Outward> sides;
  for (uint32_t f : regions.members[region])
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t across = topology.face_neighbours(f)[k];
      if (across != kNoFace && regions.region[across] == region) continue;
      const uint32_t from = mesh.triangles[f][k], to = mesh.triangles[f][(k + 1) % 3];
      if (!sides.try_emplace(from, Outward{to, topology.face_edges(f)[k]}).second) return {};
    }
  Polygon outline;
  if (sides.empty()) return outline;
  const uint32_t first = sides.begin()->first;
  for (uint32_t at = first; outline.size() < sides.size(); at = sides.at(at).to) {
    if (at == first && !outline.empty()) return {};  // a second outline is left
    outline.push_back({at, sides.at(at).edge});
    if (!sides.contains(sides.at(at).to)) return {};
  }
  return outline;
}

/// Returns convex polygons that fill a region. They are computed from the region's outline, so that it does
/// not matter how a file divides a polygon into triangles. If this is not possible, the triangles of the
/// region are returned.
std::vector<Polygon> polygons_of(const TriangleMesh& mesh, const MeshTopology& topology,
                                 const FlatRegions& regions, uint32_t region, Real tolerance) {
  std::vector<Polygon> polygons;
  if (regions.members[region].size() > 1) {
    const Polygon outline = outline_of(mesh, topology, regions, region);
    const Vec3 x = regions.planes[region].normal.unitOrthogonal(), y = regions.planes[region].normal.cross(x);
    std::vector<Vec2> flat;
    for (const PolygonSide& side : outline) {
      const Vec3 d = mesh.vertices[side.from] - mesh.vertices[outline[0].from];
      flat.emplace_back(x.dot(d), y.dot(d));
    }
    for (const std::vector<uint32_t>& piece :
         flat.empty() ? std::vector<std::vector<uint32_t>>() : convex_pieces(flat, tolerance)) {
      Polygon& polygon = polygons.emplace_back();
      for (std::size_t k = 0; k < piece.size(); ++k) {
        const bool is_side = (piece[k] + 1) % outline.size() == piece[(k + 1) % piece.size()];
        polygon.push_back({outline[piece[k]].from, is_side ? outline[piece[k]].edge : kNone});
      }
    }
  }
  if (polygons.empty())
    for (uint32_t f : regions.members[region]) {
      Polygon& triangle = polygons.emplace_back();
      for (uint32_t k = 0; k < 3; ++k) triangle.push_back({mesh.triangles[f][k], topology.face_edges(f)[k]});
    }
  return polygons;
}

/// Adds the polygons of one region to a polyhedron. `first_side`: by edge of the mesh, the half-edge that has
/// no twin yet.
void add_polygons(const std::vector<Polygon>& polygons, const FacePlane& plane,
                  std::vector<uint32_t>& first_side, Polyhedron& all) {
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> diagonals;
  const auto join = [&](uint32_t h, uint32_t& other) {
    if (other == kNone) {
      other = h;
    } else {
      all.half_edges[h].twin = other;
      all.half_edges[other].twin = h;
    }
  };
  for (const Polygon& polygon : polygons) {
    const auto first = static_cast<uint32_t>(all.half_edges.size()),
               n = static_cast<uint32_t>(polygon.size());
    const auto face = static_cast<uint32_t>(all.faces.size());
    all.faces.push_back({first, plane});
    for (uint32_t k = 0; k < n; ++k) {
      const uint32_t from = polygon[k].from, to = polygon[(k + 1) % n].from;
      all.half_edges.push_back({from, face, first + (k + 1) % n, first + (k + n - 1) % n, kNone});
      if (polygon[k].edge != kNone)
        join(first + k, first_side[polygon[k].edge]);
      else
        join(first + k, diagonals.try_emplace(std::minmax(from, to), kNone).first->second);
    }
  }
}

/// Copies the faces of one piece of surface to a polyhedron of its own.
Polyhedron extract(const Polyhedron& p, std::span<const uint32_t> faces, std::vector<uint32_t>& new_point,
                   std::vector<uint32_t>& new_half_edge) {
  Polyhedron part;
  std::vector<uint32_t> points, half_edges;
  for (uint32_t f : faces) {
    part.faces.push_back({static_cast<uint32_t>(half_edges.size()), p.faces[f].plane});
    p.for_each_around(f, [&](uint32_t h) {
      new_half_edge[h] = static_cast<uint32_t>(half_edges.size());
      half_edges.push_back(h);
      part.half_edges.push_back(p.half_edges[h]);
      part.half_edges.back().face = static_cast<uint32_t>(part.faces.size() - 1);
      uint32_t& v = new_point[p.origin(h)];
      if (v != kNone) return;
      v = static_cast<uint32_t>(points.size());
      points.push_back(p.origin(h));
      part.points.push_back(p.origin_point(h));
    });
  }
  std::vector<uint32_t> last(points.size(), kNone);
  for (uint32_t k = 0; k < part.half_edges.size(); ++k) {
    Polyhedron::HalfEdge& h = part.half_edges[k];
    h = {new_point[h.origin],   h.face, new_half_edge[h.next], new_half_edge[h.previous],
         new_half_edge[h.twin], k};
    if (last[h.origin] != kNone) std::swap(h.sibling, part.half_edges[last[h.origin]].sibling);
    last[h.origin] = k;
  }
  for (uint32_t v : points) new_point[v] = kNone;
  return part;
}

}  // namespace

Wedge::Wedge(const Vec3& edge, const Vec3& left_normal, const Vec3& right_normal)
    : along(edge.normalized()), normal(left_normal), left(left_normal.cross(along).normalized()) {
  angle = angle_of(along.cross(right_normal));
}

Real Wedge::angle_of(const Vec3& d) const {
  const Real theta = std::atan2(-normal.dot(d), left.dot(d));
  return theta < 0 ? theta + 2 * std::numbers::pi : theta;
}

Vec3 Wedge::direction(Real theta) const {
  return std::cos(theta) * left - std::sin(theta) * normal;
}

Vec3 Wedge::plane_normal(Real theta) const {
  return along.cross(direction(theta)).normalized();
}

Wedge wedge(const Polyhedron& p, uint32_t h) {
  return {p.head_point(h) - p.origin_point(h), p.plane(h).normal, p.plane(p.half_edges[h].twin).normal};
}

std::vector<Polyhedron> boundaries(const TriangleMesh& mesh, const MeshTopology& topology, Real tolerance) {
  const FlatRegions regions = flat_regions(mesh, topology, tolerance);
  Polyhedron all;
  all.points = mesh.vertices;
  std::vector<uint32_t> first_side(topology.edges().size(), kNone);
  std::vector<bool> added(regions.planes.size(), false);
  for (uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const uint32_t region = regions.region[f];
    if (added[region]) continue;
    added[region] = true;
    add_polygons(polygons_of(mesh, topology, regions, region, tolerance), regions.planes[region], first_side,
                 all);
  }
  return components(all);
}

std::vector<Polyhedron> components(const Polyhedron& p) {
  std::vector<Polyhedron> parts;
  std::vector<uint32_t> new_point(p.points.size(), kNone), new_half_edge(p.half_edges.size(), kNone);
  std::vector<bool> seen(p.faces.size(), false);
  for (uint32_t first = 0; first < p.faces.size(); ++first) {
    if (seen[first]) continue;
    std::vector<uint32_t> faces = {first};
    seen[first] = true;
    for (std::size_t k = 0; k < faces.size(); ++k)
      p.for_each_around(faces[k], [&](uint32_t h) {
        const uint32_t across = p.half_edges[p.half_edges[h].twin].face;
        if (!seen[across]) faces.push_back(across);
        seen[across] = true;
      });
    std::sort(faces.begin(), faces.end());
    parts.push_back(extract(p, faces, new_point, new_half_edge));
  }
  return parts;
}

Real signed_volume6(const Polyhedron& p) {
  const Vec3 centre = std::accumulate(p.points.begin(), p.points.end(), Vec3(Vec3::Zero())) /
                      static_cast<Real>(p.points.size());
  Real volume = 0;
  for (const Polyhedron::Face& f : p.faces) {
    const Vec3 a = p.origin_point(f.first) - centre;
    uint32_t h = p.half_edges[f.first].next;
    for (; p.half_edges[h].next != f.first; h = p.half_edges[h].next)
      volume += a.dot((p.origin_point(h) - centre).cross(p.head_point(h) - centre));
  }
  return volume;
}

}  // namespace offstage::sim
