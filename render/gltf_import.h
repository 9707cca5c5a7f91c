#pragma once
/// Private: reads glTF 2.0 files (.gltf and .glb). It handles untrusted data and therefore runs in the child
/// of read_model(), like assimp.

#include <filesystem>
#include <optional>
#include <string>

#include "render/input_folders.h"
#include "render/model.h"

namespace offstage::render {

/// Imports the default scene of a file in its rest pose: nodes, skins and morph targets applied. Does what
/// import_model() does, but its errors contain only the reason. Returns nothing for a file of version 1,
/// which assimp reads. Throws FileError.
std::optional<Model> import_gltf(const std::filesystem::path& path, const std::string& node,
                                 const InputFolders& folders, bool with_rig);

}  // namespace offstage::render
