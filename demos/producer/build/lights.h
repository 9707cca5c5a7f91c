#pragma once
/// Converts the lights and the environment of a scene to lights and an environment of the stage.

#include <string>
#include <vector>

#include "producer/build/body_places.h"
#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/stage.h"

namespace offstage::producer {

/// Returns the sun of the scene, which may be a light of a model file. A scene without a sun gets one with
/// intensity 0.
render::Sun sun_of(const Scene& scene, const ModelLibrary& models);
/// Returns the environment without the picture of the sky, which the caller sets.
render::Environment environment_of(const Scene& scene);
/// Returns all lights except the sun, in scene order. `time` is the time of the film [s].
std::vector<render::Lamp> lamps_of(const Scene& scene, const ModelLibrary& models, double time,
                                   const BodyPlaces& places, const std::vector<BodySample>& moving);
/// Returns the names of the lights that lamps_of() returns; empty for a light without a name.
std::vector<std::string> lamp_names(const Scene& scene, const ModelLibrary& models);

}  // namespace offstage::producer
