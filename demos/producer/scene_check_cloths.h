#pragma once
/// Checks of cloths, for scene_check.h.

#include <optional>
#include <string>

#include "producer/scene_check.h"
#include "sim/cloth/cloth.h"

namespace offstage::producer {

/// Adds what is wrong with the cloths of a scene as described; `flat`: with its placements expanded. What
/// takes the triangles of a file, only the simulation finds out.
void check_cloths(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings);

/// Why an explicit integrator cannot step a cloth of this scene, naming the spring and the longest step.
std::optional<std::string> too_stiff(const Scene& scene, const sim::ClothDef& cloth);

}  // namespace offstage::producer
