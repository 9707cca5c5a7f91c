#pragma once
/// Triangles on the CPU.

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace offstage::render {

using Eigen::Vector2f;
using Eigen::Vector3f;
using Eigen::Vector4f;

/// Indexed triangles. The lists of vertex data are empty or as long as `positions`; meshes without normals
/// are shaded smooth.
struct Mesh {
  std::vector<Vector3f> positions;
  std::vector<Vector3f> normals;
  std::vector<Vector2f> uvs;
  std::vector<Vector2f> second_uvs = {};  ///< texture coordinates for textures with TextureMap::uv_set 1
  /// Colours of the vertices, linear with straight alpha; used if Material::vertex_colors.
  std::vector<Vector4f> colors = {};
  /// Tangents for normal maps: unit direction of increasing u; w: sign of the bitangent, 1 or -1, as in glTF.
  /// Empty: the shader derives them from the texture coordinates.
  std::vector<Vector4f> tangents = {};
  std::vector<uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside
  /// Whether the mesh represents an infinite plane. Such a mesh fades into the sky near the horizon.
  bool endless = false;

  Eigen::AlignedBox3f bounds() const;
};

/// Sets the normal of each vertex to the area-weighted mean of its triangles. Vertices are duplicated at
/// edges whose normals differ by more than `crease_deg`, so that these edges stay sharp.
void compute_normals(Mesh& mesh, float crease_deg = 40);

}  // namespace offstage::render
