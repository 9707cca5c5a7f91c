#pragma once
/// Model files that bodies show, and the cameras and lights in them.

#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "producer/build/models.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

using FileLight = render::Model::Light;

/// The model file that a body shows.
struct ShownModel {
  std::string file;
  Eigen::Affine3f body_from_model = Eigen::Affine3f::Identity();
};
/// Returns the model file that is drawn for a body; empty if it is drawn as its shape.
std::optional<ShownModel> shown_model(const Body& body, const ModelLibrary& models);

/// Returns the body with a name, which must exist.
const Body& body_of(const Scene& scene, const std::string& name);
/// Returns the camera of the model file that an entry of the scene selects; null if there is none.
const render::Model::Camera* find_camera(const ModelCamera& camera, const Scene& scene,
                                         const ModelLibrary& models);
/// Returns whether an entry of the scene's lights selects the light `light` of its file.
bool has_light(const ModelLights& lights, const FileLight& light);

/// Returns the pose of a camera or light of the file that a body shows, in the body's frame, at a time of the
/// film [s]. It contains the model's scale.
Eigen::Affine3f pose_in_body(const Body& body, const render::Model::Place& place, const ModelLibrary& models,
                             double time);

/// Adds a problem for each camera and light of a model file that a scene asks for and that is missing or
/// cannot be used, and a warning for each file whose cameras or lights nothing uses.
void check_cameras_and_lights(const Scene& scene, const ModelLibrary& models, std::vector<Problem>& problems,
                              std::vector<Problem>& warnings);

}  // namespace offstage::producer
