#pragma once
/// Restricts the files that assimp may open to regular ones in the folders of a model. Private to render.

#include <memory>

#include <assimp/IOSystem.hpp>

#include "render/input_folders.h"

namespace offstage::render {

/// `folders` must outlive it. All other files are treated as missing.
std::unique_ptr<Assimp::IOSystem> make_model_files(const InputFolders& folders);

}  // namespace offstage::render
