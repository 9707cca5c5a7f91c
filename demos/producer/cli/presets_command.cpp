// The command presets: lists the presets that a scene can name.

#include <algorithm>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "effects/fabric.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/format/presets.h"
#include "producer/format/scene_table.h"
#include "producer/format/table_articulation.h"

namespace offstage::producer {
namespace {

struct ArticulationPreset {
  std::string name, help;
  ArticulationTemplate made;  ///< articulation with all defaults
};

std::vector<ArticulationPreset> articulation_presets() {
  std::vector<ArticulationPreset> presets;
  const auto add = [&]<class... T>(std::variant<T...>*) {
    (presets.push_back({Tags<ArticulationTemplate>::kTags[presets.size()], Table<T>::kHelp, T{}}), ...);
  };
  add(static_cast<ArticulationTemplate*>(nullptr));
  return presets;
}

/// Returns the text of the preset as part of a scene.
std::string preset_text(const ArticulationPreset& preset) {
  Scene scene;
  scene.articulations.push_back(preset.made);
  const Node written = write_scene(scene);
  const Node& all = *written.find("articulations");
  return to_text(all.as<List>()->front(), 2);
}

/// Lists all presets, one per line, or prints the text of one preset.
int presets_command(const std::string& name) {
  if (const effects::FabricPreset* preset = effects::find_fabric(name)) {
    const effects::Fabric& f = preset->fabric;
    const nlohmann::ordered_json figures = {{"areal_density", f.areal_density},
                                            {"stretch", f.stretch},
                                            {"shear", f.shear},
                                            {"bend", f.bend},
                                            {"damping", f.damping},
                                            {"friction", f.friction},
                                            {"self_friction", f.self_friction},
                                            {"thickness", f.thickness},
                                            {"drag", f.drag},
                                            {"lift", f.lift},
                                            {"max_stretch", f.max_stretch},
                                            {"max_shear", f.max_shear},
                                            {"min_bend_radius", f.min_bend_radius}};
    fmt::print("{}\n", figures.dump(2));
    return kOk;
  }
  for (const ArticulationPreset& preset : articulation_presets()) {
    if (preset.name != name) continue;
    fmt::print("{}\n", preset_text(preset));
    return kOk;
  }
  if (!name.empty()) {
    fmt::print("{}", read_text(preset_file(name)));
    return kOk;
  }
  const std::vector<std::string> names = preset_names();
  std::size_t width = 0;
  for (const std::string& preset : names) width = std::max(width, preset.size());
  for (const std::string& preset : names)
    fmt::print("{:{}}  {}\n", preset, width, preset_description(preset));
  fmt::print("\nFabrics, for the key \"fabric\" of cloths:\n");
  for (const effects::FabricPreset& fabric : effects::fabric_presets())
    fmt::print("{:{}}  {}\n", fabric.name, width, fabric.help);
  fmt::print("\nReady-made bodies with their joints, for the key \"articulations\":\n");
  for (const ArticulationPreset& preset : articulation_presets())
    fmt::print("{:{}}  {}\n", preset.name, width, preset.help.substr(0, preset.help.find_first_of(".:")));
  return kOk;
}

}  // namespace

Command add_presets(CLI::App& app) {
  const auto name = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "presets", "List the presets, fabrics and articulations for scenes, or print one of them");
  command->add_option("name", *name, "Preset, fabric or articulation to print");
  return {command, [name] { return presets_command(*name); }};
}

}  // namespace offstage::producer
