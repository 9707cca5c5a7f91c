#pragma once
/// Objects that the page can add to a scene.

#include <nlohmann/json.hpp>

namespace offstage::tune {

/// Returns the presets of effects, each with its name, its description, and the names of its emitters and
/// forces.
nlohmann::ordered_json presets_list();

}  // namespace offstage::tune
