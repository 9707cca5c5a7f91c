#include "render/model.h"

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <unordered_map>

namespace offstage::render {
namespace {

// Hash of the bits of a position. Positions are compared exactly, so that vertices that were split at seams
// of a texture are smoothed together.
struct PositionHash {
  std::size_t operator()(const std::array<float, 3>& p) const {
    uint64_t hash = 0;
    for (const float value : p) {
      uint32_t bits;
      std::memcpy(&bits, &value, sizeof bits);
      hash = (hash ^ bits) * 0x9E3779B97F4A7C15ull;
    }
    return static_cast<std::size_t>(hash ^ (hash >> 32));
  }
};

// For each position, the corners of all triangles at this position, as one flat list. A corner is an index
// into `indices`.
struct Fans {
  std::vector<uint32_t> position;  // number of the welded position of each vertex
  std::vector<uint32_t> begin;     // first element in `corner` of each position
  std::vector<uint32_t> corner;
};

Fans find_fans(const Mesh& mesh) {
  Fans fans;
  std::unordered_map<std::array<float, 3>, uint32_t, PositionHash> welded;
  welded.reserve(mesh.positions.size());
  for (const Vector3f& p : mesh.positions) {
    const auto next = static_cast<uint32_t>(welded.size());
    // Adding zero makes -0 equal to 0.
    fans.position.push_back(
        welded.try_emplace({p.x() + 0.0f, p.y() + 0.0f, p.z() + 0.0f}, next).first->second);
  }
  fans.begin.assign(welded.size() + 1, 0);
  for (const uint32_t i : mesh.indices) ++fans.begin[fans.position[i] + 1];
  for (std::size_t k = 1; k < fans.begin.size(); ++k) fans.begin[k] += fans.begin[k - 1];
  fans.corner.resize(mesh.indices.size());
  std::vector<uint32_t> next(fans.begin.begin(), fans.begin.end() - 1);
  for (uint32_t c = 0; c < mesh.indices.size(); ++c) fans.corner[next[fans.position[mesh.indices[c]]]++] = c;
  return fans;
}

// Returns the unit normal of each triangle times twice its area.
std::vector<Vector3f> area_normals(const Mesh& mesh) {
  std::vector<Vector3f> result(mesh.indices.size() / 3);
  for (std::size_t t = 0; t < result.size(); ++t) {
    const Vector3f& a = mesh.positions[mesh.indices[3 * t]];
    const Vector3f& b = mesh.positions[mesh.indices[3 * t + 1]];
    const Vector3f& c = mesh.positions[mesh.indices[3 * t + 2]];
    result[t] = (b - a).cross(c - a);
  }
  return result;
}

}  // namespace

Eigen::AlignedBox3f Mesh::bounds() const {
  Eigen::AlignedBox3f box;
  for (const Vector3f& p : positions) box.extend(p);
  return box;
}

Eigen::AlignedBox3f Model::bounds() const {
  Eigen::AlignedBox3f box;
  for (const Part& part : parts) box.extend(part.mesh.bounds());
  return box;
}

std::size_t Model::triangle_count() const {
  std::size_t count = 0;
  for (const Part& part : parts) count += part.mesh.indices.size() / 3;
  return count;
}

std::size_t Model::vertex_count() const {
  std::size_t count = 0;
  for (const Part& part : parts) count += part.mesh.positions.size();
  return count;
}

bool TextureMap::is_plain() const {
  return uv_set == 0 && rows[0] == Vector3f(1, 0, 0) && rows[1] == Vector3f(0, 1, 0);
}

bool Material::is_detailed() const {
  const bool laid = triplanar || !base_color_texture.is_plain();
  if (pattern != Pattern::none) return laid;  // a pattern replaces all other textures
  const bool more = normal_texture.image >= 0 || occlusion_texture.image >= 0 ||
                    transmission_texture.image >= 0 || specular_texture.image >= 0;
  const bool moved = !metallic_roughness_texture.is_plain() || !emission_texture.is_plain();
  return more || laid || moved || alpha_cutoff > 0 || unlit || vertex_colors || clearcoat > 0 ||
         specular != Vector3f::Constant(0.04f) || sheen_color != Vector3f::Zero();
}

void compute_normals(Mesh& mesh, float crease_deg) {
  const Fans fans = find_fans(mesh);
  const std::vector<Vector3f> area = area_normals(mesh);
  std::vector<Vector3f> unit = area;
  for (Vector3f& n : unit) n.normalize();  // a triangle without area keeps a zero normal
  // The small margin keeps edges of exactly the crease angle smooth.
  const float cos_crease = std::cos(crease_deg * std::numbers::pi_v<float> / 180.0f) - 1e-4f;

  constexpr uint32_t kNone = ~0u;
  const auto original_count = static_cast<uint32_t>(mesh.positions.size());
  mesh.normals.assign(original_count, Vector3f::UnitY());
  std::vector<uint32_t> next_copy(original_count, kNone);  // chain from a vertex to its duplicates
  std::vector<bool> used(original_count, false);
  for (uint32_t c = 0; c < mesh.indices.size(); ++c) {
    const uint32_t first = mesh.indices[c];
    const uint32_t face = c / 3;
    Vector3f sum = Vector3f::Zero();
    const uint32_t position = fans.position[first];
    for (uint32_t k = fans.begin[position]; k < fans.begin[position + 1]; ++k) {
      const uint32_t other = fans.corner[k] / 3;
      if (other == face || unit[face].dot(unit[other]) >= cos_crease) sum += area[other];
    }
    const float length = sum.norm();
    const Vector3f normal = length > 0 ? Vector3f(sum / length) : Vector3f(Vector3f::UnitY());

    uint32_t vertex = first;
    while (used[vertex] && mesh.normals[vertex] != normal && next_copy[vertex] != kNone)
      vertex = next_copy[vertex];
    if (used[vertex] && mesh.normals[vertex] != normal) {
      const auto copy = static_cast<uint32_t>(mesh.positions.size());
      mesh.positions.push_back(Vector3f(mesh.positions[first]));
      if (!mesh.uvs.empty()) mesh.uvs.push_back(Vector2f(mesh.uvs[first]));
      if (!mesh.second_uvs.empty()) mesh.second_uvs.push_back(Vector2f(mesh.second_uvs[first]));
      if (!mesh.colors.empty()) mesh.colors.push_back(Vector4f(mesh.colors[first]));
      if (!mesh.tangents.empty()) mesh.tangents.push_back(Vector4f(mesh.tangents[first]));
      mesh.normals.push_back(normal);
      next_copy[vertex] = copy;
      next_copy.push_back(kNone);
      used.push_back(true);
      vertex = copy;
    }
    used[vertex] = true;
    mesh.normals[vertex] = normal;
    mesh.indices[c] = vertex;
  }
}

}  // namespace offstage::render
