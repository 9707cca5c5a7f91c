#pragma once
/// Presets: files of emitters and forces that together are an effect, which scenes name and override.
///
/// A preset is a JSON file with a `description`, `emitters` and `forces`, as they stand in a scene, around
/// the origin. It is sought by its name in $OFFSTAGE_PRESETS, in share/offstage/presets of the installation,
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

/// Where presets are; empty if nowhere.
std::filesystem::path presets_folder();
/// Their names in order.
std::vector<std::string> preset_names();
/// The file of a preset. Throws SceneError, saying which there are, if there is none of that name.
std::filesystem::path preset_file(const std::string& name, const SceneFolder& scene_folder = {});
/// What a preset says it is. Throws SceneError.
std::string preset_description(const std::string& name);

/// Which emitters and forces of a scene come from an effect.
struct EffectParts {
  std::size_t effect = 0;
  std::size_t first_emitter = 0, emitters = 0, first_force = 0, forces = 0;
};

/// Lays presets under the emitters that name one, and adds those of effects to the emitters and forces of the
/// tree. Leaves alone, and to the reader to report, whatever is of a wrong type.
std::vector<EffectParts> lay_presets(SceneSource& source, const SceneFolder& folder,
                                     std::vector<Problem>& problems);

/// Gives what comes from effects its name, place, body and time; then the scene has no effects any more.
void place_effects(Scene& scene, const std::vector<EffectParts>& parts);

}  // namespace offstage::producer
