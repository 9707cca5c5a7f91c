#include "render/cloth_surface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace offstage::render {
namespace {

/// Meshes are subdivided until they have this many triangles, or kMostLevels times. In a picture 1280
/// pixels wide, triangles are then a few pixels wide.
constexpr std::size_t kFineTriangles = 25'000;
constexpr int kMostLevels = 3;

/// Smooth normals by N. Max's weights ("Weights for computing vertex normals from facet normals", 1999). They
/// are exact on spheres, and do not need the arc cosine that angles would need.
void smooth_normals(std::span<const Vector4f> places, std::span<const uint32_t> triangles,
                    std::vector<Vector3f>& normals) {
  constexpr float kTiny = 1e-24f;
  normals.assign(places.size(), Vector3f::Zero());
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const uint32_t i = triangles[t], j = triangles[t + 1], k = triangles[t + 2];
    const Vector3f p = places[i].head<3>(), q = places[j].head<3>(), r = places[k].head<3>();
    const Vector3f pq = q - p, qr = r - q, rp = p - r;
    const Vector3f area = pq.cross(qr);
    const float a = pq.squaredNorm() + kTiny, b = qr.squaredNorm() + kTiny, c = rp.squaredNorm() + kTiny;
    normals[i] += area / (a * c);
    normals[j] += area / (a * b);
    normals[k] += area / (b * c);
  }
  for (Vector3f& n : normals) {
    const float length = n.norm();
    n = length > 0 ? Vector3f(n / length) : Vector3f::UnitY();
  }
}

}  // namespace

void ClothSurface::set_mesh(std::span<const uint32_t> triangles, std::span<const Vector2f> uvs) {
  for (const uint32_t index : triangles)
    if (index >= uvs.size())
      throw std::invalid_argument("a triangle of a cloth refers to vertex " + std::to_string(index) + " of " +
                                  std::to_string(uvs.size()));
  if (triangles.size() % 3 != 0)
    throw std::invalid_argument("the triangles of a cloth need three indices each");
  coarse_count_ = uvs.size();
  subdivisions_.clear();
  uvs_.assign(uvs.begin(), uvs.end());
  indices_.assign(triangles.begin(), triangles.end());
  std::vector<Vector2f> finer;
  while (!indices_.empty() && indices_.size() < 3 * kFineTriangles && levels() < kMostLevels) {
    subdivisions_.emplace_back(indices_, uvs_);
    subdivisions_.back().refine(std::span<const Vector2f>(uvs_), finer);
    uvs_.swap(finer);
    indices_ = subdivisions_.back().triangles();
  }
  rim_ = boundary_edges(indices_);
  auto vertex = static_cast<uint32_t>(uvs_.size());
  for (std::size_t e = 0; e < rim_.size(); ++e, vertex += 4) {
    for (const uint32_t corner : {0u, 2u, 1u, 1u, 2u, 3u}) indices_.push_back(vertex + corner);
  }
  vertices_.clear();
  ++version_;
}

void ClothSurface::set_positions(std::span<const Vector3f> positions, float thickness) {
  if (positions.size() != coarse_count_)
    throw std::invalid_argument("a cloth of " + std::to_string(coarse_count_) + " vertices got " +
                                std::to_string(positions.size()) + " positions");
  places_.resize(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) places_[v] << positions[v], 0;
  for (const LoopSubdivision& subdivision : subdivisions_) {
    subdivision.refine(std::span<const Vector4f>(places_), finer_);
    places_.swap(finer_);
  }
  const std::span<const uint32_t> sheet(indices_.data(), indices_.size() - 6 * rim_.size());
  smooth_normals(places_, sheet, normals_);

  const float half = 0.5f * thickness;
  vertices_.resize(places_.size() + 4 * rim_.size());
  box_.setEmpty();
  bool finite = true;
  for (std::size_t v = 0; v < places_.size(); ++v) {
    const Vector3f p = places_[v].head<3>();
    finite = finite && p.allFinite();
    box_.extend(p);
    vertices_[v] = {p, normals_[v], half, uvs_[v]};
  }
  ClothVertex* rim = vertices_.data() + places_.size();
  for (const auto& [a, b] : rim_) {
    const Vector3f along = vertices_[b].position - vertices_[a].position;
    for (const uint32_t end : {a, b}) {
      const ClothVertex& v = vertices_[end];
      const Vector3f outwards = along.cross(v.normal).normalized();
      for (const float side : {half, -half}) *rim++ = {v.position + side * v.normal, outwards, 0, v.uv};
    }
  }
  if (!finite) {
    vertices_.clear();
    box_.setEmpty();
  }
}

}  // namespace offstage::render
