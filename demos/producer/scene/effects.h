#pragma once
/// Effects of a scene: presets at a place; see scene.h and presets.h.

#include <string>
#include <vector>

#include "producer/base/json.h"
#include "producer/scene/values.h"

namespace offstage::producer {

/// For emitters and forces of a preset, by their names: the keys to replace.
struct Overrides {
  Node node = Object{};
};

/// All emitters and forces of a preset.
struct Effect {
  Where where;
  std::string preset;
  std::string name;  ///< prefix of the names of its emitters and forces; default: the preset's name
  Vec3 position = Vec3::Zero();
  std::string body;  ///< body with which its emitters move; the position is then in the body's frame
  Real start = 0;
  Overrides overrides;
};

}  // namespace offstage::producer
