#pragma once
/// Effects of a scene: presets that are placed in it; see scene.h and presets.h.

#include <string>
#include <vector>

#include "producer/base/json.h"
#include "producer/scene/values.h"

namespace offstage::producer {

/// Changes to a preset: an object that maps the name of an emitter or force to the keys that are replaced.
struct Overrides {
  Node node = Object{};
};

/// A use of a preset: it adds all emitters and forces of the preset to the scene.
struct Effect {
  Where where;
  std::string preset;
  std::string name;  ///< prefix of the names of the effect's objects; default: the preset's name
  Vec3 position = Vec3::Zero();
  std::string body;  ///< body that carries the emitters; `position` is then in the body's frame
  Real start = 0;
  Overrides overrides;
};

}  // namespace offstage::producer
