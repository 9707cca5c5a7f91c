#pragma once
/// Checks of cloths, for scene_check.h.

#include <filesystem>

#include "producer/base/scene_folder.h"
#include "producer/format/scene_check.h"

namespace offstage::producer {

/// Adds the problems of the cloths of a scene to `findings`; `flat` is the same scene with placements
/// expanded to copies. Does not read model files; checks that need their triangles are made when the
/// simulation is built.
void check_cloths(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings);

}  // namespace offstage::producer
