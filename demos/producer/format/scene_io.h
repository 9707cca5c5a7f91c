#pragma once
/// Reads scene files and reports all their problems at once. Also generates the schema and the reference from
/// the table of keys.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "producer/base/error.h"
#include "producer/base/scene_folder.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

struct LoadedScene {
  Scene scene;
  SceneFolder folder;  ///< folder to which file names in the scene are relative
  std::vector<Problem> warnings;
  /// The scene with all overrides and defaults, as compact JSON; it determines the result of a run.
  std::string canonical;
};

/// Reads a scene file and its includes, applies `overrides` ("path=value", path as a JSON pointer or dotted),
/// and checks the result. The file "-" is standard input. Files that the scene names must be in its folder or
/// in one of the `allowed` folders. Throws SceneError with the problems.
LoadedScene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides = {},
                       const std::vector<std::string>& allowed = {});

/// Loads a scene from text; `name` is used as the file name in messages.
LoadedScene parse_scene(std::string_view text, const std::string& name, const SceneFolder& folder,
                        const std::vector<std::string>& overrides = {});

/// Names of the cameras of a scene: kMainCamera, then those of `cameras`.
std::vector<std::string> camera_names(const Scene& scene);
/// Selects the camera that is drawn. Throws std::invalid_argument for an unknown name.
void choose_camera(LoadedScene& loaded, const std::string& name);

/// JSON Schema, draft 07.
std::string scene_schema();

/// The reference of the format in Markdown: one table per object.
std::string scene_reference();

}  // namespace offstage::producer
