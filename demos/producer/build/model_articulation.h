#pragma once
/// Articulations from the node trees of model files.

#include <vector>

#include "producer/base/scene_folder.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

/// Reads the links of the scene's model trees from their files, relative to `folder`. Errors are added to
/// `errors`.
void read_links(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors);

}  // namespace offstage::producer
