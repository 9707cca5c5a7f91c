#pragma once
/// Presets: files of emitters and forces that form an effect. A scene uses a preset by its name and can
/// override its values.
///
/// A preset is a JSON file with a `description`, `emitters` and `forces` in the form of a scene, around the
/// origin. It is looked up by its name in $OFFSTAGE_PRESETS, in share/offstage/presets of the installation,
/// or in effects/presets of the source; a name that ends with .json is a file relative to the scene.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "producer/base/error.h"
#include "producer/base/scene_folder.h"
#include "producer/format/scene_source.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

/// Returns the folder of the presets; an empty path if there is none.
std::filesystem::path presets_folder();
/// Returns the names of all presets, sorted.
std::vector<std::string> preset_names();
/// Returns the file of a preset. If there is no preset of that name, throws SceneError with the existing
/// names.
std::filesystem::path preset_file(const std::string& name, const SceneFolder& scene_folder = {});
/// Returns the description of a preset. Throws SceneError if there is no such preset or its file is invalid.
std::string preset_description(const std::string& name);

/// The ranges of a scene's emitters and forces that come from one effect.
struct EffectParts {
  std::size_t effect = 0;  ///< index of the effect
  std::size_t first_emitter = 0, emitters = 0, first_force = 0, forces = 0;
};

/// Completes each emitter that names a preset with the keys of that preset. Also appends the emitters and
/// forces of all effects to the lists of the tree, and returns where they are. Adds an error for an unknown
/// or invalid preset to `problems`. Values of a wrong type stay unchanged; the reader reports them later.
std::vector<EffectParts> apply_presets(SceneSource& source, const SceneFolder& folder,
                                       std::vector<Problem>& problems);

/// Applies the name, position, body and start of each effect to its emitters and forces. Then removes the
/// effects from the scene.
void place_effects(Scene& scene, const std::vector<EffectParts>& parts);

}  // namespace offstage::producer
