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
  /// The scene with all overrides and defaults, as compact JSON. Equal texts give equal results of a run.
  std::string canonical;
};

/// Reads a scene file and its includes, applies `overrides`, and checks the result. An override is
/// "path=value"; the path is a JSON pointer (/world/seed) or has dots (world.seed). The file "-" is standard
/// input. Files that the scene names must be in its folder or in one of the `allowed` folders. Throws
/// SceneError with all problems.
LoadedScene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides = {},
                       const std::vector<std::string>& allowed = {});

/// Loads a scene from text, otherwise like load_scene(). `name` is the file name in messages; `folder` is the
/// folder to which file names in the text are relative.
LoadedScene parse_scene(std::string_view text, const std::string& name, const SceneFolder& folder,
                        const std::vector<std::string>& overrides = {});

/// Returns the names of the cameras of a scene: kMainCamera, then the names in `cameras`.
std::vector<std::string> camera_names(const Scene& scene);
/// Makes a named camera the camera that is drawn. Throws std::invalid_argument for an unknown name.
void choose_camera(LoadedScene& loaded, const std::string& name);

/// Returns the JSON Schema (draft 07) of scene files, as text.
std::string scene_schema();

/// Returns the reference of the scene format in Markdown, with one table per object.
std::string scene_reference();

}  // namespace offstage::producer
