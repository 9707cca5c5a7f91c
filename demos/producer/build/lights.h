#pragma once
/// Conversion of a scene's lights and environment to those of the stage.

#include <string>
#include <vector>

#include "producer/build/body_places.h"
#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/stage.h"

namespace offstage::producer {

/// The sun, which may be a light of a model file; without one, a sun of intensity 0.
render::Sun sun_of(const Scene& scene, const ModelLibrary& models);
/// Returns the environment without the picture of the sky, which the caller sets.
render::Environment environment_of(const Scene& scene);
/// The lights of a scene other than the sun at a time [s], in scene order.
std::vector<render::Lamp> lamps_of(const Scene& scene, const ModelLibrary& models, double time,
                                   const BodyPlaces& places, const std::vector<BodySample>& moving);
/// The names of the lights that lamps_of() returns; empty for a light without a name.
std::vector<std::string> lamp_names(const Scene& scene, const ModelLibrary& models);

}  // namespace offstage::producer
