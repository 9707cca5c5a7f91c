#pragma once
/// Private: materials and textures of glTF files.

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "render/gltf_file.h"
#include "render/model.h"

namespace offstage::render {

/// The sets of texture coordinates (TEXCOORD_n) that a material uses, for Mesh::uvs and Mesh::second_uvs;
/// -1: none.
using GltfUvSets = std::array<int, 2>;

class GltfMaterials {
 public:
  GltfMaterials(GltfFile& file, Model& model) : file_(file), model_(model) {}

  /// Fills Model::materials and Model::textures; the material after the last one of the file is the default.
  void read();
  const GltfUvSets& uv_sets(std::size_t material) const { return uv_sets_[material]; }

 private:
  enum class Alpha { keep, drop };
  Material material(const GltfValue& source, GltfUvSets& sets);
  void read_alpha(const GltfValue& source, Material& look);
  void read_metallic(const GltfValue& source, Material& look, GltfUvSets& sets);
  void read_glossiness(const GltfValue& source, Material& look, GltfUvSets& sets);
  void read_transmission(const GltfValue& source, Material& look, GltfUvSets& sets);
  void read_layers(const GltfValue& source, Material& look, GltfUvSets& sets);
  void read_iridescence(const GltfValue& source, Material& look);
  void warn_of_textures(const GltfValue& source, std::initializer_list<const char*> names);
  TextureMap map(const GltfValue& owner, const char* name, Alpha alpha, GltfUvSets& sets);
  void read_sampler(const GltfValue& texture, TextureMap& result);
  int slot(std::size_t set, GltfUvSets& sets, const std::string& place);
  int image(const GltfValue& texture, Alpha alpha);
  Image decoded(std::size_t index);

  GltfFile& file_;
  Model& model_;
  std::vector<GltfUvSets> uv_sets_;
  std::map<std::pair<std::size_t, Alpha>, int> images_;  ///< images in use, with and without alpha
};

}  // namespace offstage::render
