#pragma once
/// Private: the surface that is drawn of a cloth. Its mesh is subdivided until it is fine, so that contact
/// creases are round; normals are smooth; a rim as wide as the cloth is thick closes its boundary; and how
/// far each place lies in a fold darkens what the sky does not reach.

#include <cstdint>
#include <span>
#include <vector>

#include "render/loop_subdivision.h"
#include "render/model.h"

namespace offstage::render {

struct ClothVertex {
  Vector3f position;  ///< of the middle layer; of rims on the surface
  float hollow;       ///< depth of the fold it lies in over its width: positive in hollows of the front
  Vector3f normal;    ///< of the front; of rims outwards
  float lift;         ///< half the thickness [m]; 0 of rims
  Vector2f uv;        ///< [m] along the cloth
};
static_assert(sizeof(ClothVertex) == 40);

class ClothSurface {
 public:
  /// Throws std::invalid_argument for an index out of range, or if there is not one texture coordinate for
  /// each vertex.
  void set_mesh(std::span<const uint32_t> triangles, std::span<const Vector2f> uvs);
  /// One position for each vertex of the mesh, else std::invalid_argument. Nothing is drawn if one is not
  /// finite.
  void set_positions(std::span<const Vector3f> positions, float thickness);

  std::span<const ClothVertex> vertices() const { return vertices_; }
  const std::vector<uint32_t>& indices() const { return indices_; }
  /// Counts set_mesh: tells whether `indices` are those that were uploaded.
  uint32_t version() const { return version_; }
  const Eigen::AlignedBox3f& box() const { return box_; }
  int levels() const { return static_cast<int>(subdivisions_.size()); }

 private:
  void measure_hollows();

  std::size_t coarse_count_ = 0;
  std::vector<uint32_t> coarse_triangles_;
  std::vector<uint32_t> first_neighbor_, neighbors_;  // of the coarse vertices
  std::vector<LoopSubdivision> subdivisions_;
  std::vector<BoundaryEdge> rim_;
  std::vector<uint32_t> indices_;  // of the sheet, then of the rim
  std::vector<Vector2f> uvs_;      // of the fine vertices
  uint32_t version_ = 0;

  std::vector<Vector4f> places_, finer_, smooth_, smoother_;  // w: hollow
  std::vector<Vector3f> normals_;
  std::vector<ClothVertex> vertices_;
  Eigen::AlignedBox3f box_;
};

}  // namespace offstage::render
