#include "producer/format/scene_io.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>

#include <nlohmann/json.hpp>

#include "producer/base/suggest.h"
#include "producer/build/model_articulation.h"
#include "producer/build/placement.h"
#include "producer/format/presets.h"
#include "producer/format/scene_check.h"
#include "producer/format/scene_source.h"
#include "producer/format/scene_table.h"

namespace offstage::producer {
namespace {

template <class T>
void name_objects(std::vector<T>& objects, const std::string& kind) {
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (objects[i].name.empty()) objects[i].name = kind + "_" + std::to_string(i);
}

void name_everything(Scene& scene, const std::string& file) {
  if (scene.name.empty())
    scene.name = file == kStandardInputName ? "stdin" : std::filesystem::path(file).stem().string();
  name_objects(scene.materials, "material");
  name_objects(scene.bodies, "body");
  name_objects(scene.particles, "particles");
  name_objects(scene.emitters, "emitter");
  name_objects(scene.springs, "spring");
  name_objects(scene.joints, "joint");
  name_objects(scene.cloths, "cloth");
  for (std::size_t i = 0; i < scene.articulations.size(); ++i)
    std::visit(
        [i](auto& a) {
          if (a.name.empty()) a.name = "articulation_" + std::to_string(i);
        },
        scene.articulations[i]);
  for (std::size_t i = 0; i < scene.forces.size(); ++i)
    if (std::string& name = named(scene.forces[i]).name; name.empty()) name = "force_" + std::to_string(i);
}

/// Keeps the first kMostProblems problems, and replaces the others by one that gives their number.
void count_the_rest(std::vector<Problem>& problems, std::size_t more) {
  if (problems.size() > kMostProblems) {
    more += problems.size() - kMostProblems;
    problems.resize(kMostProblems);
  }
  if (more > 0) problems.push_back({{}, "and " + std::to_string(more) + " more problems"});
}

/// Throws SceneError for a scene with so many bodies that their descriptions alone would take too much
/// memory.
void check_count(const SceneSource& source) {
  const Node* bodies = source.root.find("bodies");
  const List* list = bodies ? bodies->as<List>() : nullptr;
  if (list && list->size() > kMostBodies)
    throw SceneError(source.locate("/bodies"), "has " + std::to_string(list->size()) + " bodies, at most " +
                                                   std::to_string(kMostBodies) +
                                                   " are possible: each takes up to 10 kB");
}

/// Removes keys that had a meaning only in earlier versions, so that old scenes can be read. Returns a
/// warning for each of these keys.
std::vector<Problem> drop_retired_keys(SceneSource& source) {
  constexpr std::pair<const char*, const char*> kRetired[] = {{"environment", "occlusion"},
                                                              {"render", "shadow_map"}};
  std::vector<Problem> warnings;
  for (const auto& [name, key] : kRetired) {
    Node* owner = source.root.find(name);
    if (owner == nullptr || !owner->find(key)) continue;
    const Where where = source.locate("/" + std::string(name) + "/" + key);
    warnings.push_back({where, "has no effect since light is traced; remove it"});
    const std::string retired = key;  // Clang 14 cannot capture `key`
    std::erase_if(std::get<Object>(owner->value),
                  [&](const Member& member) { return member.key == retired; });
  }
  return warnings;
}

void append(std::vector<Problem>& all, const std::vector<Problem>& more, const SceneSource& source) {
  // Finding a position takes time. Problems that are only counted need no position.
  constexpr std::size_t kLocated = 4 * kMostProblems;
  for (const Problem& problem : more)
    all.push_back({all.size() < kLocated ? source.locate(problem.where.path) : problem.where, problem.what});
}

void sort_by_place(std::vector<Problem>& problems) {
  std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
    const Where &x = a.where, &y = b.where;
    return std::tie(x.file, x.line, x.column, x.path) < std::tie(y.file, y.line, y.column, y.path);
  });
}

}  // namespace

LoadedScene parse_scene(std::string_view text, const std::string& name, const SceneFolder& folder,
                        const std::vector<std::string>& overrides) {
  const SuggestionBudget budget;
  SceneSource source = read_source(text, name, folder);
  check_count(source);
  std::vector<Problem> errors;
  const Node defaults = write_scene({});
  for (const std::string& override : overrides) apply_override(source, override, defaults, errors);
  const std::vector<EffectParts> from_effects = apply_presets(source, folder, errors);

  const std::vector<Problem> retired = drop_retired_keys(source);
  Scene described;
  Reader reader(source.files, objects_with_key);
  read_scene(reader, source.root, described);
  errors.insert(errors.end(), reader.problems().begin(), reader.problems().end());
  // A picture of the sky has its own sun, so the default sun is removed.
  if (described.environment.picture && source.root.find("lights") == nullptr) described.lights.clear();
  place_effects(described, from_effects);
  name_everything(described, name);

  std::vector<Problem> misplaced, crowded;
  std::string canonical = to_text(write_scene(described));
  read_links(described, folder, misplaced);
  read_clouds(described, folder, misplaced);
  read_fills(described, folder, misplaced);
  LoadedScene loaded{expand(described, misplaced, crowded), folder, {}, std::move(canonical)};
  const Findings findings = check_scene(described, loaded.scene, folder);
  append(errors, misplaced, source);
  append(errors, findings.errors, source);
  loaded.warnings = retired;
  append(loaded.warnings, crowded, source);
  append(loaded.warnings, findings.warnings, source);
  sort_by_place(errors);
  sort_by_place(loaded.warnings);
  count_the_rest(loaded.warnings, 0);
  count_the_rest(errors, reader.more());
  if (!errors.empty()) throw SceneError(std::move(errors));
  return loaded;
}

LoadedScene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       const std::vector<std::string>& allowed) {
  if (file == kStandardInput)
    return parse_scene(standard_input(), kStandardInputName, SceneFolder({}, allowed), overrides);
  return parse_scene(read_text(file), file.string(), SceneFolder(file.parent_path(), allowed), overrides);
}

std::vector<std::string> camera_names(const Scene& scene) {
  std::vector<std::string> names = {kMainCamera};
  for (const NamedCamera& camera : scene.cameras) names.push_back(camera.name);
  return names;
}

void choose_camera(LoadedScene& loaded, const std::string& name) {
  if (name == kMainCamera) return;
  const auto& cameras = loaded.scene.cameras;
  const auto chosen = std::ranges::find(cameras, name, &NamedCamera::name);
  if (chosen == cameras.end())
    throw std::invalid_argument("there is no camera '" + name + "'" +
                                suggestion(name, camera_names(loaded.scene)));
  auto json = nlohmann::ordered_json::parse(loaded.canonical);
  json["camera"] = json["cameras"].at(static_cast<std::size_t>(chosen - cameras.begin()))["camera"];
  loaded.canonical = json.dump();
  loaded.scene.camera = chosen->camera;
}

}  // namespace offstage::producer
