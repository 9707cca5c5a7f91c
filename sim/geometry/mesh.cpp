#include "sim/geometry/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <utility>

namespace offstage::sim {
namespace {

/// The bits of a position, for exact comparison. -0 counts as +0.
struct PositionKey {
  std::array<uint64_t, 3> bits;

  explicit PositionKey(const Vec3& p) {
    const Vec3 canonical = p + Vec3::Zero();
    std::memcpy(bits.data(), canonical.data(), sizeof bits);
  }
  friend bool operator==(const PositionKey&, const PositionKey&) = default;
};

struct PositionHash {
  std::size_t operator()(const PositionKey& key) const {
    uint64_t h = 0;
    for (uint64_t word : key.bits) {
      h = (h ^ word) * 0x9e3779b97f4a7c15u;
      h ^= h >> 32;
    }
    return h;
  }
};

bool repeats_a_vertex(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

Vec3 doubled_area(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

/// Returns the angle of a triangle at its corner `k` [rad].
Real corner_angle(const TriangleMesh& mesh, const Triangle& t, std::size_t k) {
  const Vec3& p = mesh.vertices[t[k]];
  const Vec3 u = mesh.vertices[t[(k + 1) % 3]] - p, v = mesh.vertices[t[(k + 2) % 3]] - p;
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// One side of a face, stored at the side's vertex of lower index.
struct HalfEdge {
  uint32_t other;  // the higher vertex
  uint32_t face;
  uint8_t side;
  bool ascending;  // the face runs from the lower vertex to the higher
};

/// Replaces the count of each bucket by the offset of its first entry. The last entry becomes the total.
void counts_to_starts(std::vector<uint32_t>& start) {
  uint32_t total = 0;
  for (uint32_t& s : start) total += std::exchange(s, total);
}

/// The half-edges of a mesh, sorted by the lower vertex, then by the higher vertex, then by the face.
class HalfEdges {
 public:
  explicit HalfEdges(const TriangleMesh& mesh) : start_(mesh.vertices.size() + 1, 0) {
    for_each_side(mesh, [&](uint32_t low, const HalfEdge&) { ++start_[low]; });
    counts_to_starts(start_);
    edges_.resize(start_.back());
    std::vector<uint32_t> next = start_;
    for_each_side(mesh, [&](uint32_t low, const HalfEdge& e) { edges_[next[low]++] = e; });
    for (std::size_t v = 0; v + 1 < start_.size(); ++v)
      std::sort(edges_.begin() + start_[v], edges_.begin() + start_[v + 1],
                [](const HalfEdge& a, const HalfEdge& b) {
                  return std::pair(a.other, a.face) < std::pair(b.other, b.face);
                });
  }

  /// Calls f(low, group) for the half-edges of each undirected edge.
  template <class F>
  void for_each_edge(F&& f) const {
    for (uint32_t v = 0; v + 1 < start_.size(); ++v)
      for (uint32_t i = start_[v]; i < start_[v + 1];) {
        uint32_t j = i + 1;
        while (j < start_[v + 1] && edges_[j].other == edges_[i].other) ++j;
        f(v, std::span(edges_).subspan(i, j - i));
        i = j;
      }
  }

 private:
  template <class F>
  static void for_each_side(const TriangleMesh& mesh, F&& f) {
    for (uint32_t face = 0; face < mesh.triangles.size(); ++face) {
      const Triangle& t = mesh.triangles[face];
      if (repeats_a_vertex(t)) continue;
      for (uint8_t side = 0; side < 3; ++side) {
        const uint32_t a = t[side], b = t[(side + 1u) % 3u];
        f(std::min(a, b), HalfEdge{std::max(a, b), face, side, a < b});
      }
    }
  }

  std::vector<uint32_t> start_;
  std::vector<HalfEdge> edges_;
};

/// Returns six times the signed volume. Coordinates are relative to a point near the mesh, which limits
/// cancellation.
Real signed_volume6(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  const Vec3 origin = mesh.vertices.front();
  Real volume = 0;
  for (const Triangle& t : mesh.triangles)
    volume += (mesh.vertices[t[0]] - origin)
                  .dot((mesh.vertices[t[1]] - origin).cross(mesh.vertices[t[2]] - origin));
  return volume;
}

/// Reverses faces until two faces with a common edge run along it in opposite directions, so that the surface
/// has a consistent front side. In each connected part of the surface, the orientation with the smaller total
/// area is reversed. A part with only one side, such as a Moebius strip, is not changed.
void unify_winding(TriangleMesh& mesh) {
  struct Neighbour {
    uint32_t face;
    bool is_opposed;  // whether it is wound the other way
  };
  const std::size_t faces = mesh.triangles.size();
  std::vector<std::vector<Neighbour>> neighbours(faces);
  bool any_opposed = false;
  HalfEdges(mesh).for_each_edge([&](uint32_t, std::span<const HalfEdge> sides) {
    if (sides.size() != 2) return;
    const bool is_opposed = sides[0].ascending == sides[1].ascending;
    any_opposed |= is_opposed;
    neighbours[sides[0].face].push_back({sides[1].face, is_opposed});
    neighbours[sides[1].face].push_back({sides[0].face, is_opposed});
  });
  if (!any_opposed) return;
  std::vector<uint8_t> is_seen(faces, 0), is_turned(faces, 0);
  for (uint32_t first = 0; first < faces; ++first) {
    if (is_seen[first]) continue;
    is_seen[first] = 1;
    std::vector<uint32_t> part = {first};
    bool has_sides = true;
    for (std::size_t i = 0; i < part.size(); ++i)
      for (const Neighbour& n : neighbours[part[i]]) {
        const uint8_t turned = is_turned[part[i]] ^ static_cast<uint8_t>(n.is_opposed);
        if (is_seen[n.face]) {
          has_sides &= is_turned[n.face] == turned;
          continue;
        }
        is_seen[n.face] = 1;
        is_turned[n.face] = turned;
        part.push_back(n.face);
      }
    if (!has_sides) continue;
    std::array<Real, 2> area = {0, 0};
    for (const uint32_t face : part) area[is_turned[face]] += doubled_area(mesh, mesh.triangles[face]).norm();
    const uint8_t smaller = area[1] > area[0] ? 0 : 1;
    for (const uint32_t face : part)
      if (is_turned[face] == smaller) std::swap(mesh.triangles[face][1], mesh.triangles[face][2]);
  }
}

}  // namespace

std::string MeshDefects::describe() const {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  const auto add_count = [&](uint32_t n, const char* what) {
    if (n > 0) add(std::to_string(n) + ' ' + what + (n > 1 ? "s" : ""));
  };
  add_count(border_edges, "border edge");
  add_count(non_manifold_edges, "non-manifold edge");
  add_count(flipped_edges, "flipped edge");
  add_count(degenerate_faces, "degenerate face");
  if (inverted) add("faces point inwards");
  return text;
}

TriangleMesh weld(const TriangleMesh& mesh) {
  constexpr uint32_t kUnused = 0xffffffff;
  // The first vertex at a position represents all of them.
  std::unordered_map<PositionKey, uint32_t, PositionHash> first;
  first.reserve(mesh.vertices.size());
  std::vector<uint32_t> representative(mesh.vertices.size());
  for (uint32_t i = 0; i < mesh.vertices.size(); ++i)
    representative[i] = first.try_emplace(PositionKey(mesh.vertices[i]), i).first->second;

  TriangleMesh out;
  std::vector<uint32_t> renumbered(mesh.vertices.size(), kUnused);
  for (const Triangle& t : mesh.triangles) {
    const Triangle joined = {representative[t[0]], representative[t[1]], representative[t[2]]};
    if (repeats_a_vertex(joined)) continue;
    out.triangles.push_back(joined);
    for (uint32_t v : joined) renumbered[v] = 0;
  }
  for (uint32_t i = 0; i < mesh.vertices.size(); ++i) {
    if (renumbered[i] == kUnused) continue;
    renumbered[i] = static_cast<uint32_t>(out.vertices.size());
    out.vertices.push_back(mesh.vertices[i]);
  }
  for (Triangle& t : out.triangles)
    for (uint32_t& v : t) v = renumbered[v];
  unify_winding(out);
  return out;
}

MeshTopology::MeshTopology(const TriangleMesh& mesh) {
  const std::size_t faces = mesh.triangles.size(), vertices = mesh.vertices.size();
  face_neighbours_.assign(faces, {kNoFace, kNoFace, kNoFace});
  face_edges_.assign(faces, {kNoFace, kNoFace, kNoFace});
  edges_.reserve(faces * 3 / 2);

  HalfEdges(mesh).for_each_edge([&](uint32_t low, std::span<const HalfEdge> sides) {
    const auto edge = static_cast<uint32_t>(edges_.size());
    const bool border = sides.size() == 1;
    edges_.push_back({{low, sides[0].other}, {sides[0].face, border ? kNoFace : sides[1].face}});
    for (const HalfEdge& s : sides) face_edges_[s.face][s.side] = edge;
    if (border) {
      ++defects_.border_edges;
    } else if (sides.size() > 2) {
      ++defects_.non_manifold_edges;
    } else {
      if (sides[0].ascending == sides[1].ascending) ++defects_.flipped_edges;
    }
    if (border) return;
    face_neighbours_[sides[0].face][sides[0].side] = sides[1].face;
    for (std::size_t k = 1; k < sides.size(); ++k)
      face_neighbours_[sides[k].face][sides[k].side] = sides[0].face;
  });

  // Stores the faces around each vertex. They are in ascending order, because faces are visited in this
  // order.
  vertex_face_start_.assign(vertices + 1, 0);
  for (const Triangle& t : mesh.triangles)
    for (uint32_t v : t) ++vertex_face_start_[v];
  counts_to_starts(vertex_face_start_);
  vertex_faces_.resize(vertex_face_start_.back());
  std::vector<uint32_t> next = vertex_face_start_;
  for (uint32_t face = 0; face < faces; ++face)
    for (uint32_t v : mesh.triangles[face]) vertex_faces_[next[v]++] = face;

  // Stores the neighbours of each vertex in ascending order: edges are sorted by (low, high), so each vertex
  // gets first its lower neighbours and then its higher ones.
  vertex_neighbour_start_.assign(vertices + 1, 0);
  for (const Edge& e : edges_)
    for (uint32_t v : e.vertices) ++vertex_neighbour_start_[v];
  counts_to_starts(vertex_neighbour_start_);
  vertex_neighbours_.resize(vertex_neighbour_start_.back());
  next = vertex_neighbour_start_;
  for (const Edge& e : edges_) {
    vertex_neighbours_[next[e.vertices[0]]++] = e.vertices[1];
    vertex_neighbours_[next[e.vertices[1]]++] = e.vertices[0];
  }

  // Computes the normals of faces, edges and vertices. The normals of edges and vertices are also the
  // pseudonormals that determine inside and outside (Baerentzen and Aanaes, "Signed distance computation
  // using the angle weighted pseudonormal", 2005).
  face_normals_.resize(faces);
  vertex_normals_.assign(vertices, Vec3::Zero());
  for (std::size_t face = 0; face < faces; ++face) {
    const Triangle& t = mesh.triangles[face];
    const Vec3 area = doubled_area(mesh, t);
    const Real norm = area.norm();
    if (!(norm > 0)) {
      ++defects_.degenerate_faces;
      face_normals_[face].setZero();
      continue;
    }
    face_normals_[face] = area / norm;
    for (std::size_t k = 0; k < 3; ++k)
      vertex_normals_[t[k]] += corner_angle(mesh, t, k) * face_normals_[face];
  }
  for (Vec3& n : vertex_normals_) n.normalize();
  edge_normals_.reserve(edges_.size());
  for (const Edge& e : edges_) {
    Vec3 n = face_normals_[e.faces[0]];
    if (e.faces[1] != kNoFace) n += face_normals_[e.faces[1]];
    edge_normals_.push_back(n.normalized());
  }
  defects_.inverted = defects_.closed() && signed_volume6(mesh) < 0;
}

std::span<const uint32_t> MeshTopology::vertex_faces(uint32_t vertex) const {
  return std::span(vertex_faces_)
      .subspan(vertex_face_start_[vertex], vertex_face_start_[vertex + 1] - vertex_face_start_[vertex]);
}

std::span<const uint32_t> MeshTopology::vertex_neighbours(uint32_t vertex) const {
  const uint32_t begin = vertex_neighbour_start_[vertex];
  return std::span(vertex_neighbours_).subspan(begin, vertex_neighbour_start_[vertex + 1] - begin);
}

}  // namespace offstage::sim
