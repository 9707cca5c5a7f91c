#pragma once
/// The untrusted part of read_model: assimp and the conversion of its scene. It may crash or hang on a
/// hostile file, so read_model runs it in a child process. Private to render.

#include <filesystem>
#include <vector>

#include "render/model.h"

struct aiScene;

namespace offstage::render {

<<<<<<< ours
/// One part per material; those whose file has no normals have none. Of a `node` its own triangles alone,
/// seen from where it is; empty: all. Throws FileError.
Model import_model(const std::filesystem::path& path, const std::string& node);
=======
/// Imports a model with one part per material; parts whose file has no normals have none. If `node` is not
/// empty, only that node's own triangles are imported, in the node's frame. Files outside `folders` are
/// treated as missing. Throws FileError.
Model import_model(const std::filesystem::path& path, const std::string& node, const InputFolders& folders);
>>>>>>> theirs

/// Fills `materials` and `textures`, with a warning for each missing texture. Textures are searched as named,
/// then by file name beside the model. Returns for each material the index of the texture coordinates that it
/// uses.
std::vector<unsigned> import_materials(const aiScene& scene, const std::filesystem::path& folder,
                                       Model& model);

}  // namespace offstage::render
