#pragma once
/// The files that assimp may open: regular ones in the folders of a model. Private to render.

#include <memory>

#include <assimp/IOSystem.hpp>

#include "render/input_folders.h"

namespace offstage::render {

/// `folders` must outlive it. Every other file is not there.
std::unique_ptr<Assimp::IOSystem> make_model_files(const InputFolders& folders);

}  // namespace offstage::render
