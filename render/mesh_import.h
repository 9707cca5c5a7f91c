#pragma once
/// The part of read_model() that handles untrusted data: assimp, and the conversion of its scene. It may
/// crash or hang on a hostile file, so read_model() runs it in a child process. Private to render.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "render/input_folders.h"
#include "render/model.h"
#include "render/mtl_file.h"

struct aiScene;

namespace offstage::render {

/// Imports a model with one part per material; parts whose file has no normals have none. With `node`, only
/// the triangles of this node, in its frame; empty: all. Files outside of `folders` are treated as missing.
/// Throws FileError.
Model import_model(const std::filesystem::path& path, const std::string& node, const InputFolders& folders);

/// Fills `materials` and `textures`, with a warning for each texture that is not found. Textures are searched
/// by the name given, then by file name beside the model. `mtl` completes the materials of OBJ files by name.
/// Returns for each material the number of its set of
/// texture coordinates.
std::vector<unsigned> import_materials(const aiScene& scene, const std::filesystem::path& folder,
                                       const InputFolders& folders,
                                       const std::map<std::string, MtlMaterial>& mtl, Model& model);

}  // namespace offstage::render
