#pragma once
/// Checks of overlays, cameras, lights, the environment and the output that need the whole scene.

#include "producer/base/scene_folder.h"
#include "producer/format/scene_check.h"

namespace offstage::producer {

/// Adds the problems of a scene's film to `findings`. `flat` is the same scene with placements expanded to
/// copies. File names are relative to `folder`.
void check_film(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings);

}  // namespace offstage::producer
