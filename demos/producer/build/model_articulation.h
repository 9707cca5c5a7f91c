#pragma once
/// Reads the files that define objects of a scene: the node trees of articulations, point clouds, and models
/// that are filled with copies or particles.

#include <vector>

#include "producer/base/scene_folder.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

/// Reads the links of the scene's model trees from their files, relative to `folder`. Errors are added to
/// `errors`.
void read_links(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors);

/// Reads the point files of particle groups and appends their points to ParticleGroup::places. Errors are
/// added to `errors`.
void read_clouds(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors);

/// Reads the models that fills of bodies, cloths, emitters and particle groups name. Errors are added to
/// `errors`.
void read_fills(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors);

}  // namespace offstage::producer
