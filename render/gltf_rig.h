#pragma once
/// Private: the nodes, animations and skins of a glTF file as a ModelRig, and the surfaces that they move.

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "render/gltf_file.h"
#include "render/gltf_geometry.h"
#include "render/model_rig.h"

namespace offstage::render {

class GltfRig {
 public:
  /// Prepares the rig of a file. `parents`: parent of each node of the file, or -1; `order`: all nodes,
  /// parents first.
  GltfRig(GltfFile& file, GltfGeometry& geometry, std::span<const int> parents,
          std::span<const std::size_t> order);

  /// Adds the primitives of a node's mesh. `instances`: transforms of the instances of the mesh in the node's
  /// frame. A mesh that deforms is drawn once, with a warning.
  void add_mesh(std::size_t node, std::size_t mesh, std::span<const Eigen::Affine3d> instances);
  /// Returns the index of a node of the file in the rig.
  int index_of(std::size_t node) const { return rig_index_[node]; }
  /// Reads the animations and returns the rig. Must be called after all meshes were added.
  ModelRig finish();

 private:
  void add_rigid(RigSurface surface, std::span<const Eigen::Affine3d> instances);
  RigSurface surface_of(const GltfPrimitive& primitive);
  void read_targets(const GltfValue& primitive, RigSurface& surface);
  int skin(std::size_t index);
  RigClip clip(std::size_t index);
  std::optional<RigChannel> channel(const GltfValue& animation, std::size_t index);

  GltfFile& file_;
  GltfGeometry& geometry_;
  ModelRig rig_;
  std::vector<int> rig_index_;  ///< index in the rig of each node of the file
  std::map<std::size_t, int> skins_;
};

/// Names and durations of a file's animations.
std::vector<Model::Clip> gltf_clips(GltfFile& file);

}  // namespace offstage::render
