#pragma once
/// Private: meshes of glTF files: primitives, morph targets and skins.

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "render/gltf_file.h"
#include "render/gltf_material.h"
#include "render/part_builder.h"

namespace offstage::render {

/// A primitive as triangles, with the joints and weights for a skin.
struct GltfPrimitive {
  FileSurface surface;
  std::size_t points = 0,
              lines = 0;  ///< number of points and lines of a primitive without triangles; they are not drawn
  std::vector<uint32_t> joints;  ///< indices into the joints of the skin, `influences` for each vertex
  std::vector<float> weights;    ///< weight of each entry of `joints`
  std::size_t influences = 0;    ///< joints per vertex
};

class GltfGeometry {
 public:
  GltfGeometry(GltfFile& file, const GltfMaterials& materials, Model& model)
      : file_(file), materials_(materials), model_(model) {}

  std::size_t primitive_count(std::size_t mesh) const {
    return file_.item("meshes", mesh).count("primitives");
  }
  /// Returns a primitive without its morph targets. Each primitive is read only once.
  const GltfPrimitive& primitive(std::size_t mesh, std::size_t index);
  /// Returns a primitive with its morph targets applied, or nothing if the weights of all targets are 0. The
  /// `weights` of a node replace the weights of the mesh.
  std::optional<FileSurface> morphed(std::size_t mesh, std::size_t index, const GltfValue& node);
  /// Poses a surface by the joints' transforms (section 3.7.3.3): positions are then in the scene's frame.
  FileSurface posed(const FileSurface& surface, const GltfPrimitive& source,
                    const std::vector<Eigen::Affine3d>& joints) const;

 private:
  struct Source;
  GltfPrimitive read(const GltfValue& source);
  void read_attributes(const Source& source, GltfPrimitive& result);
  void read_triangles(const Source& source, GltfPrimitive& result);
  void read_joints(const Source& source, GltfPrimitive& result);
  void mark_colors(FileSurface& surface);

  GltfFile& file_;
  const GltfMaterials& materials_;
  Model& model_;
  std::map<std::pair<std::size_t, std::size_t>, GltfPrimitive> primitives_;
};

}  // namespace offstage::render
