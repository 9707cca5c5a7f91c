#pragma once
/// The files that come with the program: presets of effects, and models.

#include <filesystem>
#include <string>
#include <string_view>

#include "producer/base/scene_folder.h"

namespace offstage::producer {

/// Returns the folder `installed` of the folder named by OFFSTAGE_DATA, else of ../share/offstage beside the
/// program, else `source` in the source tree from which it was compiled; empty if none exists.
std::filesystem::path shipped_folder(std::string_view installed, std::string_view source);

/// Returns the file of a model named by a scene, FILE or FILE#NODE: relative to the scene's folder or, if
/// that does not exist and the name has no folder, one of the models that come with the program.
std::filesystem::path model_file(const std::string& name, const SceneFolder& scene_folder);

}  // namespace offstage::producer
