#include "sim/geometry/convex_polyhedron.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace offstage::sim {

namespace {

/// Returns the power of two that scales the largest coordinate to about 1. Products of scaled coordinates
/// neither overflow nor underflow, and the scaling is exact.
Real scale_to_one(const std::vector<Vec3>& points) {
  constexpr int kMost = 1000;  // 2^1000 and its inverse are finite
  Real largest = 0;
  for (const Vec3& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  if (!(largest > 0) || !std::isfinite(largest)) return 1;
  return std::ldexp(Real(1), -std::clamp(std::ilogb(largest), -kMost, kMost));
}

}  // namespace

ConvexPolyhedron::ConvexPolyhedron(std::vector<Vec3> vertices, std::span<const std::vector<uint32_t>> faces)
    : vertices_(std::move(vertices)) {
  for (const std::vector<uint32_t>& face : faces) {
    if (face.size() < 3) throw std::invalid_argument("a face needs at least three vertices");
    for (uint32_t v : face)
      if (v >= vertices_.size())
        throw std::invalid_argument("vertex index " + std::to_string(v) +
                                    " of a face is out of range; there are " +
                                    std::to_string(vertices_.size()) + " vertices");
    face_vertices_.items.insert(face_vertices_.items.end(), face.begin(), face.end());
    face_vertices_.start.push_back(static_cast<uint32_t>(face_vertices_.items.size()));
  }
  if (faces.empty() && vertices_.size() > 2) throw std::invalid_argument("more than two vertices need faces");

  for (const Vec3& v : vertices_) {
    centre_ += v / static_cast<Real>(vertices_.size());
    box_.extend(v);
  }
  const Real scale = scale_to_one(vertices_);
  for (const Vec3& v : vertices_) reach_ = std::max(reach_, (v * scale).norm() / scale);
  find_edges();
  find_planes();
  find_edge_frames();
  dimension_ = face_count() > 2 ? 3 : face_count() == 2 ? 2 : static_cast<int>(edges_.size());
}

/// Finds the edges by pairing the directed sides of the faces, and lists the edges of each vertex.
void ConvexPolyhedron::find_edges() {
  struct Side {
    uint32_t low, high, slot, face;
    bool forward;
  };
  std::vector<Side> sides;
  for (uint32_t f = 0; f + 1 < face_vertices_.start.size(); ++f) {
    const std::span<const uint32_t> loop = face_vertices_.row(f);
    for (uint32_t k = 0; k < loop.size(); ++k) {
      const uint32_t a = loop[k], b = loop[(k + 1) % loop.size()];
      sides.push_back({std::min(a, b), std::max(a, b), face_vertices_.start[f] + k, f, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& s, const Side& t) {
    return std::tie(s.low, s.high, t.forward) < std::tie(t.low, t.high, s.forward);
  });
  face_edges_.start = face_vertices_.start;
  face_edges_.items.resize(sides.size());
  for (std::size_t i = 0; i < sides.size(); i += 2) {
    const auto same = [&](std::size_t j) {
      return j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;
    };
    if (!same(i + 1) || same(i + 2) || !sides[i].forward || sides[i + 1].forward)
      throw std::invalid_argument("an edge is not shared by exactly two faces with opposite directions");
    face_edges_.items[sides[i].slot] = face_edges_.items[sides[i + 1].slot] =
        static_cast<uint32_t>(edges_.size());
    edges_.push_back({sides[i].low, sides[i].high, sides[i].face, sides[i + 1].face});
  }
  if (sides.empty() && vertices_.size() == 2) edges_.push_back({0, 1, kNoFace, kNoFace});

  std::vector<std::vector<uint32_t>> at(vertices_.size());
  for (uint32_t e = 0; e < edges_.size(); ++e) {
    at[edges_[e].tail].push_back(e);
    at[edges_[e].head].push_back(e);
  }
  for (uint32_t v = 0; v < at.size(); ++v) {
    for (uint32_t e : at[v]) {
      vertex_edges_.items.push_back(e);
      vertex_neighbours_.items.push_back(edges_[e].tail == v ? edges_[e].head : edges_[e].tail);
    }
    vertex_edges_.start.push_back(static_cast<uint32_t>(vertex_edges_.items.size()));
  }
  vertex_neighbours_.start = vertex_edges_.start;
}

/// Computes Newell's normal of each face, and the offset for which all vertices of the face are on the plane
/// or below it.
void ConvexPolyhedron::find_planes() {
  const Real scale = scale_to_one(vertices_);
  for (uint32_t f = 0; f + 1 < face_vertices_.start.size(); ++f) {
    const std::span<const uint32_t> loop = face_vertices_.row(f);
    const Vec3& origin = vertices_[loop[0]];
    Vec3 area = Vec3::Zero();
    for (std::size_t k = 1; k + 1 < loop.size(); ++k)
      area += ((vertices_[loop[k]] - origin) * scale).cross((vertices_[loop[k + 1]] - origin) * scale);
    const Vec3 normal = area.normalized();
    Real offset = -std::numeric_limits<Real>::infinity();
    for (uint32_t v : loop) offset = std::max(offset, normal.dot(vertices_[v]));
    planes_.push_back({normal, offset});
  }
}

void ConvexPolyhedron::find_edge_frames() {
  const Real scale = scale_to_one(vertices_);
  for (const Edge& e : edges_) {
    const Vec3 along = ((vertices_[e.head] - vertices_[e.tail]) * scale).normalized();
    const Vec3 left = e.left == kNoFace ? Vec3::Zero() : planes_[e.left].normal,
               right = e.right == kNoFace ? Vec3::Zero() : planes_[e.right].normal;
    edge_frames_.push_back({along, left.cross(along), along.cross(right)});
  }
}

TriangleMesh ConvexPolyhedron::triangles() const {
  TriangleMesh mesh;
  mesh.vertices = vertices_;
  for (uint32_t f = 0; f < face_count(); ++f) {
    const std::span<const uint32_t> loop = face_vertices(f);
    for (std::size_t k = 1; k + 1 < loop.size(); ++k)
      mesh.triangles.push_back({loop[0], loop[k], loop[k + 1]});
  }
  return mesh;
}

ConvexPolyhedron box_polyhedron(const Vec3& size) {
  std::vector<Vec3> vertices;
  for (int i = 0; i < 8; ++i)
    vertices.push_back(size.cwiseProduct(Vec3(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5)));
  const std::array<std::vector<uint32_t>, 6> faces = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  return {std::move(vertices), faces};
}

Real concavity(const ConvexPolyhedron& p) {
  Real worst = -std::numeric_limits<Real>::infinity();
  for (uint32_t f = 0; f < p.face_count(); ++f)
    for (const Vec3& v : p.vertices()) worst = std::max(worst, p.plane(f).normal.dot(v) - p.plane(f).offset);
  return worst;
}

}  // namespace offstage::sim
