#include "sim/collision/mesh_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/collision/collision_mesh.h"

namespace offstage::sim {
namespace {

/// A triangle with a smaller area than this fraction of its longest edge squared has no reliable normal.
constexpr Real kSliver = 1e-5;
/// Greatest number of consecutive slivers that are skipped.
constexpr int kMostSlivers = 16;
/// A normal outside of a region by less than this sine counts as inside, because normals are not more
/// accurate.
constexpr Real kOff = 1e-5;
/// Points count as on an edge or a vertex if they are nearer to it than this fraction of the longest edge.
constexpr Real kOnFeature = 1e-6;

bool is_thin(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  const Real longest2 = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return !((b - a).cross(c - a).norm() > kSliver * longest2);
}

std::size_t longest_edge(const TriangleMesh& mesh, const Triangle& t) {
  std::size_t longest = 0;
  Real length2 = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    const Real l2 = (mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]).squaredNorm();
    if (l2 <= length2) continue;
    length2 = l2;
    longest = k;
  }
  return longest;
}

/// Returns the unit vector that is perpendicular to an edge and points into a triangle at this edge. It is
/// zero if the triangle has no area.
Vec3 inward(const TriangleMesh& mesh, uint32_t face, const Vec3& from, const Vec3& to) {
  const Vec3 along = (to - from).normalized();
  Vec3 best = Vec3::Zero();
  for (uint32_t v : mesh.triangles[face]) {
    const Vec3 arm = mesh.vertices[v] - from, across = arm - along.dot(arm) * along;
    if (across.squaredNorm() > best.squaredNorm()) best = across;
  }
  const Real length = best.norm();
  return length > 0 ? Vec3(best / length) : best;
}

}  // namespace

MeshSurface::MeshSurface(const TriangleMesh& mesh, const MeshTopology& topology) {
  std::vector<uint8_t> at_border(mesh.vertices.size(), 0);
  for (const Edge& e : topology.edges())
    if (e.faces[1] == kNoFace)
      for (uint32_t v : e.vertices) at_border[v] = 1;
  faces_.resize(mesh.triangles.size());
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    faces_[f].sliver = is_thin(mesh, t);
    faces_[f].at_border = at_border[t[0]] || at_border[t[1]] || at_border[t[2]];
  }
  for (uint32_t f = 0; f < faces_.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      uint32_t from = f, next = topology.face_neighbours(f)[k];
      for (int i = 0; i < kMostSlivers && next != kNoFace && faces_[next].sliver; ++i) {
        // If the sliver is entered through its longest edge, the search goes on through the longest of its
        // other edges.
        const auto& around = topology.face_neighbours(next);
        std::size_t out = longest_edge(mesh, mesh.triangles[next]);
        if (around[out] == from) out = around[(out + 1) % 3] != kNoFace ? (out + 1) % 3 : (out + 2) % 3;
        from = std::exchange(next, around[out]);
      }
      faces_[f].across[k] = next;
    }
}

Vec3 SurfaceTriangle::normal() const {
  return side * mesh->topology.face_normal(face);
}

const Vec3& SurfaceTriangle::corner(std::size_t k) const {
  return mesh->mesh.vertices[mesh->mesh.triangles[face][k % 3]];
}

Real SurfaceTriangle::fall(std::size_t k) const {
  const uint32_t next = mesh->surface.across(face)[k];
  return next == kNoFace ? 0 : -normal().dot(inward(mesh->mesh, next, corner(k), corner(k + 1)));
}

SurfaceTriangle SurfaceTriangle::neighbour(std::size_t k) const {
  const uint32_t next = mesh->surface.across(face)[k];
  const Triangle &own = mesh->mesh.triangles[face], &other = mesh->mesh.triangles[next];
  // Triangles of the same winding pass their common edge in opposite directions.
  bool is_turned = false;
  for (std::size_t i = 0; i < 3; ++i)
    is_turned |= other[i] == own[k] && other[(i + 1) % 3] == own[(k + 1) % 3];
  return {mesh, next, is_turned ? -side : side};
}

bool SurfaceTriangle::edge_allows(std::size_t k, const Vec3& n, Real guard) const {
  const Vec3 &from = corner(k), &to = corner(k + 1);
  const uint32_t next = mesh->surface.across(face)[k];
  Real most = kOff;
  if (next != kNoFace) {
    const Vec3 into = inward(mesh->mesh, next, from, to);
    most = std::max(most, -guard * normal().dot(into));
    if (n.dot(into) > most) return false;
  }
  return n.dot(inward(mesh->mesh, face, from, to)) <= most;
}

bool SurfaceTriangle::vertex_allows(uint32_t vertex, const Vec3& n, Real guard) const {
  const TriangleMesh& m = mesh->mesh;
  for (uint32_t f : mesh->topology.vertex_faces(vertex)) {
    const SurfaceTriangle t{mesh, f, side};
    const Triangle& corners = m.triangles[f];
    for (std::size_t k = 0; k < 3; ++k) {
      const bool begins = corners[k] == vertex, ends = corners[(k + 1) % 3] == vertex;
      if (!begins && !ends) {
        // This is the edge opposite to the vertex. In a sliver the vertex may lie on this edge.
        if (mesh->surface.is_sliver(f) && !t.edge_allows(k, n, guard)) return false;
        continue;
      }
      const Vec3 along = (begins ? 1 : -1) * (t.corner(k + 1) - t.corner(k)).normalized();
      const Real off = n.dot(along);
      if (off > kOff && !(off <= guard * t.fall(k))) return false;
    }
  }
  return true;
}

Real SurfaceTriangle::near2() const {
  Real longest2 = 0;
  for (std::size_t k = 0; k < 3; ++k)
    longest2 = std::max(longest2, (corner(k + 1) - corner(k)).squaredNorm());
  return kOnFeature * kOnFeature * longest2;
}

bool SurfaceTriangle::runs_along_neighbour(const Vec3& point, const Vec3& n) const {
  for (std::size_t k = 0; k < 3; ++k) {
    const uint32_t next = mesh->surface.across(face)[k];
    if (next == kNoFace || std::abs(n.dot(mesh->topology.face_normal(next))) > kAlongside) continue;
    const Vec3 edge = corner(k + 1) - corner(k), arm = point - corner(k);
    if (edge.cross(arm).squaredNorm() > near2() * edge.squaredNorm()) continue;
    if (n.dot(inward(mesh->mesh, next, corner(k), corner(k + 1))) > 0) return true;
  }
  return false;
}

bool SurfaceTriangle::allows(const Vec3& point, const Vec3& n, Real guard) const {
  const Vec3 up = normal();
  if (n.dot(up) > 0 && n.cross(up).squaredNorm() <= kOff * kOff) return true;
  const Real near2 = this->near2();
  for (std::size_t k = 0; k < 3; ++k)
    if ((point - corner(k)).squaredNorm() <= near2)
      return vertex_allows(mesh->mesh.triangles[face][k], n, guard);
  bool on_edge = false;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 edge = corner(k + 1) - corner(k), arm = point - corner(k);
    if (edge.cross(arm).squaredNorm() > near2 * edge.squaredNorm()) continue;
    on_edge = true;
    if (!edge_allows(k, n, guard)) return false;
  }
  return on_edge;
}

}  // namespace offstage::sim
