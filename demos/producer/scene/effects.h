#pragma once
/// Effects of a scene: presets at some place; see scene.h and presets.h.

#include <string>
#include <vector>

#include "producer/base/json.h"
#include "producer/scene/values.h"

namespace offstage::producer {

/// The names of a preset's emitters and forces with the keys that replace theirs.
struct Overrides {
  Node node = Object{};
};

/// All emitters and forces of a preset.
struct Effect {
  Where where;
  std::string preset;
  std::string name;  ///< before the names of its emitters and forces; default: the preset's
  Vec3 position = Vec3::Zero();
  std::string body;  ///< that its emitters move with; the position is then in its frame
  Real start = 0;
  Overrides overrides;
};

}  // namespace offstage::producer
