#pragma once
/// The files that belong to a model. assimp may open only regular files in the folders of the model. Private
/// to render.

#include <filesystem>
#include <memory>
#include <string>

#include <assimp/IOSystem.hpp>

#include "render/input_folders.h"

namespace offstage::render {

/// Returns the file access for assimp: it can open regular files in `folders`, and all other files are
/// treated as missing. `folders` must outlive the result.
std::unique_ptr<Assimp::IOSystem> make_model_files(const InputFolders& folders);

/// Returns whether a file name ends in `ending`, in any letter case.
bool has_ending(const std::filesystem::path& path, const std::string& ending);

/// Finds a file that a model refers to. Tries the given path, then its file name in the model's folder, then
/// the file name in any letter case, because models often contain paths of another machine. Empty if no file
/// is found.
std::filesystem::path find_beside(const std::filesystem::path& folder, std::string name);

}  // namespace offstage::render
