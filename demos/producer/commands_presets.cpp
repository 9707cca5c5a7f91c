// presets: what there is to name in a scene.

#include <algorithm>

#include <fmt/format.h>

#include "producer/command_line.h"
#include "producer/commands.h"
#include "producer/presets.h"

namespace offstage::producer {

int presets_command(const std::string& name) {
  if (!name.empty()) {
    fmt::print("{}", read_text(preset_file(name)));
    return kOk;
  }
  const std::vector<std::string> names = preset_names();
  std::size_t width = 0;
  for (const std::string& preset : names) width = std::max(width, preset.size());
  for (const std::string& preset : names)
    fmt::print("{:{}}  {}\n", preset, width, preset_description(preset));
  return kOk;
}

}  // namespace offstage::producer
