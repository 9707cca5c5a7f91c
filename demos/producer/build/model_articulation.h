#pragma once
/// Objects of a scene that follow from the data of files: articulations from the node trees of models,
/// particles from point clouds, and particles that fill models.

#include <vector>

#include "producer/base/scene_folder.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

/// Reads the links of the scene's model trees from their files, relative to `folder`. Errors are added to
/// `errors`.
void read_links(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors);

/// Appends the points of files to the places of their particle groups. Errors are added to `errors`.
void read_clouds(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors);

/// Reads the models that fills of bodies, cloths, emitters and particle groups name. Errors are added to
/// `errors`.
void read_fills(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors);

}  // namespace offstage::producer
