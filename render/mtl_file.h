#pragma once
/// Private: the statements of MTL files that assimp does not read (Wavefront's material library format,
/// 1995): options of textures, masks, bump maps, and the physically based values Pr and Pm.

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "render/input_folders.h"

namespace offstage::render {

/// A texture statement, such as "map_Kd -s 2 2 1 wood.png".
struct MtlMap {
  std::string file;
  Eigen::Vector2f scale = {1, 1}, offset = {0, 0};  ///< -s and -o
  float bump = 1;                                   ///< -bm
  bool clamp = false;                               ///< -clamp on
};

struct MtlMaterial {
  /// Textures by the names of their statements in lower case: map_kd, map_d, bump, norm, map_ke ...
  std::map<std::string, MtlMap> maps;
  std::optional<float> roughness, metallic;  ///< Pr, Pm
  std::set<std::string> ignored;             ///< names of the statements without effect, in lower case
};

/// Parses the text of a material library and adds its materials.
void read_mtl(const std::string& text, std::map<std::string, MtlMaterial>& materials);

/// Returns only the statements that assimp reads correctly: names, colours, numbers, and textures without
/// options. assimp misreads options with fewer values than usual, and refuses statements such as `decal`.
std::string mtl_for_assimp(const std::string& text);

/// Reads the material libraries that an OBJ file names. Adds a line to `warnings` for each library that is
/// not in `folders`, and, if all libraries are there, for the used materials that none of them defines.
std::map<std::string, MtlMaterial> read_mtl_of(const std::filesystem::path& obj, const InputFolders& folders,
                                               std::vector<std::string>& warnings);

}  // namespace offstage::render
