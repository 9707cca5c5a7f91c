#pragma once
/// The part of read_model that trusts nobody: assimp and what is made of its scene. It may crash or hang on a
/// hostile file, which is why read_model runs it in a child process. Private to render.

#include <filesystem>
#include <vector>

#include "render/input_folders.h"
#include "render/model.h"

struct aiScene;

namespace offstage::render {

/// One part per material; those whose file has no normals have none. Of a `node` its own triangles alone,
/// seen from where it is; empty: all. Files outside of `folders` are not there for it. Throws FileError.
Model import_model(const std::filesystem::path& path, const std::string& node, const InputFolders& folders);

/// Fills `materials` and `textures`, with a warning for each texture that is not found. Textures are looked
/// for as named, then by file name beside the model. Returns for each material the set of texture coordinates
/// it uses.
std::vector<unsigned> import_materials(const aiScene& scene, const std::filesystem::path& folder,
                                       const InputFolders& folders, Model& model);

}  // namespace offstage::render
