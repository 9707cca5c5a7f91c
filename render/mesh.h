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
  /// Direction of increasing u for normal maps; w is 1 or -1, the side of the direction of increasing v.
  /// Empty: derived from the texture coordinates while drawing.
  std::vector<Vector4f> tangents = {};
  std::vector<uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside
  /// Marks a mesh that stands for an infinite plane. It fades into the sky near its horizon, where it is seen
  /// at a grazing angle.
  bool endless = false;

  Eigen::AlignedBox3f bounds() const;
};

/// Fills `normals` with area-weighted means, split at edges sharper than `crease_deg` (vertices are
/// duplicated there).
void compute_normals(Mesh& mesh, float crease_deg = 40);

}  // namespace offstage::render
