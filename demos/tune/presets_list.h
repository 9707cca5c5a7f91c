#pragma once
/// Objects that the page can add to a scene.

#include <nlohmann/json.hpp>

namespace offstage::tune {

/// Presets of effects: name, description, and names of the emitters and forces.
nlohmann::ordered_json presets_list();

}  // namespace offstage::tune
