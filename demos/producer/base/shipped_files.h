#pragma once
/// The files that come with the program: presets of effects, and models.

#include <filesystem>
#include <string>
#include <string_view>

#include "producer/base/scene_folder.h"

namespace offstage::producer {

/// Returns the first of the following folders that exists, or an empty path:
/// - $OFFSTAGE_DATA/`installed`;
/// - ../share/offstage/`installed`, relative to the folder of the program;
/// - `source` in the source tree from which the program was compiled.
std::filesystem::path shipped_folder(std::string_view installed, std::string_view source);

/// Returns the file of a model named by a scene, FILE or FILE#NODE: relative to the scene's folder or, if
/// that does not exist and the name has no folder, one of the models that come with the program.
std::filesystem::path model_file(const std::string& name, const SceneFolder& scene_folder);

}  // namespace offstage::producer
