#include "tune/presets_list.h"

#include "producer/base/error.h"
#include "producer/base/json.h"
#include "producer/format/presets.h"
#include "producer/format/scene_source.h"

namespace offstage::tune {

nlohmann::ordered_json presets_list() {
  auto all = nlohmann::ordered_json::array();
  for (const std::string& name : producer::preset_names()) {
    try {
      const std::string file = producer::preset_file(name).string();
      const producer::Node tree = producer::parse_json(producer::read_text(file), file);
      all.push_back({{"name", name}, {"preset", nlohmann::ordered_json::parse(producer::to_text(tree))}});
    } catch (const SceneError&) {
      continue;  // an invalid preset is not offered; scenes that name it report why
    }
  }
  return all;
}

}  // namespace offstage::tune
