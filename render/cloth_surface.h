#pragma once
/// Private: the drawn surface of a cloth. The simulated mesh is subdivided until creases at contacts look
/// round, and gets smooth normals. A rim as wide as the cloth is thick closes the boundary.

#include <cstdint>
#include <span>
#include <vector>

#include "render/loop_subdivision.h"
#include "render/model.h"

namespace offstage::render {

struct ClothVertex {
  Vector3f position;  ///< position on the middle layer of the cloth; rim vertices lie on the surface
  Vector3f normal;    ///< normal of the front; rim normals point outwards
  float lift;         ///< half the thickness [m]; 0 for rim vertices
  Vector2f uv;        ///< position along the cloth [m]
};
static_assert(sizeof(ClothVertex) == 36);

class ClothSurface {
 public:
  /// Sets triangles and texture coordinates. Throws std::invalid_argument for an index out of range, or if
  /// the number of texture coordinates is not the number of vertices.
  void set_mesh(std::span<const uint32_t> triangles, std::span<const Vector2f> uvs);
  /// Sets one position per vertex of the mesh; throws std::invalid_argument for another number. The cloth is
  /// not drawn if a position is not finite.
  void set_positions(std::span<const Vector3f> positions, float thickness);

  std::span<const ClothVertex> vertices() const { return vertices_; }
  const std::vector<uint32_t>& indices() const { return indices_; }
  /// Returns the number of calls of set_mesh(), to check whether uploaded `indices` are current.
  uint32_t version() const { return version_; }
  const Eigen::AlignedBox3f& box() const { return box_; }
  int levels() const { return static_cast<int>(subdivisions_.size()); }

 private:
  std::size_t coarse_count_ = 0;
  std::vector<LoopSubdivision> subdivisions_;
  std::vector<BoundaryEdge> rim_;
  std::vector<uint32_t> indices_;  // triangles of the sheet, then those of the rim
  std::vector<Vector2f> uvs_;      // for the fine vertices
  uint32_t version_ = 0;

  std::vector<Vector4f> places_, finer_;  // w is not used
  std::vector<Vector3f> normals_;
  std::vector<ClothVertex> vertices_;
  Eigen::AlignedBox3f box_;
};

}  // namespace offstage::render
