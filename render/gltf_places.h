#pragma once
/// Private: the cameras and lights of glTF files (sections 3.10 of the specification, KHR_lights_punctual).

#include <optional>

#include "render/gltf_file.h"
#include "render/model.h"

namespace offstage::render {

/// Returns the camera of a node, without the data of Model::Place. Returns nothing if the node has no camera,
/// or, with a warning, if the camera has no usable field of view.
std::optional<Model::Camera> gltf_camera(GltfFile& file, const GltfValue& node);

/// Returns the light of a node, without the data of Model::Place. Returns nothing if the node has no light,
/// or, with a warning, if the light has an unknown type or values out of range.
std::optional<Model::Light> gltf_light(GltfFile& file, const GltfValue& node);

}  // namespace offstage::render
