#pragma once
/// Private: the cameras and lights of glTF files (sections 3.10 of the specification, KHR_lights_punctual).

#include <optional>

#include "render/gltf_file.h"
#include "render/model.h"

namespace offstage::render {

/// The camera of a node, without its place; empty if the node has none, or, with a warning, one without a
/// usable field of view.
std::optional<Model::Camera> gltf_camera(GltfFile& file, const GltfValue& node);

/// The light of a node, without its place; empty if the node has none, or, with a warning, one of an unknown
/// type or with values out of range.
std::optional<Model::Light> gltf_light(GltfFile& file, const GltfValue& node);

}  // namespace offstage::render
