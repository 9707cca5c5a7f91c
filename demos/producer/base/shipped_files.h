#pragma once
/// The files that come with the program: presets of effects, and models.

#include <filesystem>
#include <string>
#include <string_view>

#include "producer/base/scene_folder.h"

namespace offstage::producer {

/// The folder `installed` of the one that OFFSTAGE_DATA names, else of ../share/offstage beside the program,
/// else `source` in the source that it was compiled from; empty if neither is there.
std::filesystem::path shipped_folder(std::string_view installed, std::string_view source);

/// The file of a model that a scene names, FILE or FILE#NODE: relative to the scene's folder; where that does
/// not exist and the name has no folder, one of the models that come with the program.
std::filesystem::path model_file(const std::string& name, const SceneFolder& scene_folder);

}  // namespace offstage::producer
