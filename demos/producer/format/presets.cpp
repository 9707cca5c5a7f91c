#include "producer/format/presets.h"

#include <algorithm>
#include <cstdlib>
#include <map>

#include "producer/base/json.h"
#include "producer/base/shipped_files.h"
#include "producer/base/suggest.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

std::string text_of(const Node* node) {
  const std::string* text = node ? node->as<std::string>() : nullptr;
  return text ? *text : "";
}

/// Returns the list at a key of an object. Creates the list if the key is missing. Returns null if the value
/// is not a list.
List* list_in(Node& object, std::string_view key) {
  if (Node* node = object.find(key)) return node->as<List>();
  Object* members = object.as<Object>();
  members->push_back({std::string(key), Node(List{})});
  return members->back().value.as<List>();
}

void erase(Node& node, std::string_view key) {
  if (Object* object = node.as<Object>())
    std::erase_if(*object, [&](const Member& member) { return member.key == key; });
}

std::vector<std::string> preset_names_in(const Node* list) {
  std::vector<std::string> names;
  if (list && list->as<List>())
    for (const Node& item : *list->as<List>()) names.push_back(text_of(item.find("name")));
  return names;
}

class Layer {
 public:
  Layer(SceneSource& source, const SceneFolder& folder, std::vector<Problem>& problems)
      : source_(source), folder_(folder), problems_(problems) {}

  void lay_under_emitters() {
    Node* emitters = source_.root.find("emitters");
    List* list = emitters ? emitters->as<List>() : nullptr;
    for (std::size_t i = 0; list && i < list->size(); ++i)
      lay_under((*list)[i], "/emitters/" + std::to_string(i));
  }

  std::vector<EffectParts> add_effects() {
    std::vector<EffectParts> all;
    const Node* effects = source_.root.find("effects");
    if (!effects || !effects->as<List>()) return all;
    const List list = *effects->as<List>();
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (!list_in(source_.root, "emitters") || !list_in(source_.root, "forces")) return all;
      add(list[i], i, all);
    }
    return all;
  }

 private:
  void fail(const Node& at, const std::string& path, const std::string& what) {
    const std::string file = at.at.file < 0 ? "" : source_.files[static_cast<std::size_t>(at.at.file)];
    problems_.push_back({{file, at.at.line, at.at.column, path}, what});
  }

  /// Returns the tree of a preset. If it cannot be read, adds a problem and returns null.
  const Node* preset(const std::string& name, const Node& at, const std::string& path) {
    if (const auto known = presets_.find(name); known != presets_.end()) return &known->second;
    try {
      const fs::path file = preset_file(name, folder_);
      if (const std::string wrong = folder_.wrong_place(file); !wrong.empty()) throw SceneError({}, wrong);
      const int number = static_cast<int>(source_.files.size());
      source_.files.push_back(file.string());
      Node tree = parse_json(read_text(file), file.string(), number);
      check(tree, file.string());
      return &presets_.emplace(name, std::move(tree)).first->second;
    } catch (const SceneError& error) {
      for (const Problem& problem : error.problems())
        if (problem.where.file.empty())
          fail(at, path, problem.what);
        else
          problems_.push_back(problem);
    }
    return nullptr;
  }

  void check(const Node& tree, const std::string& file) {
    const Object* object = tree.as<Object>();
    if (!object) throw SceneError({file, tree.at.line, tree.at.column, ""}, "must be an object");
    for (const Member& member : *object)
      if (const std::vector<std::string> keys = {"description", "emitters", "forces"};
          std::ranges::find(keys, member.key) == keys.end())
        problems_.push_back({{file, member.at.line, member.at.column, "/" + member.key},
                             "unknown key in preset" + suggestion(member.key, keys)});
  }

  void lay_under(Node& emitter, const std::string& path) {
    const Node* key = emitter.find("preset");
    const std::string name = text_of(key);
    if (name.empty()) return;
    const std::size_t slash = name.ends_with(".json") ? std::string::npos : name.find('/');
    const Node* tree = preset(name.substr(0, slash), *key, path + "/preset");
    if (!tree) return;
    const std::string part = slash == std::string::npos ? "" : name.substr(slash + 1);
    const Node* emitters = tree->find("emitters");
    const std::vector<std::string> parts = preset_names_in(emitters);
    const auto it = part.empty() ? parts.begin() : std::ranges::find(parts, part);
    if (it == parts.end())
      return fail(*key, path + "/preset",
                  "the preset '" + name.substr(0, slash) + "' has no emitter '" + part + "'" +
                      suggestion(part, parts));
    Node base = (*emitters->as<List>())[static_cast<std::size_t>(it - parts.begin())];
    erase(base, "name");
    merge(base, std::move(emitter));
    emitter = std::move(base);
  }

  /// Appends the items of a preset's list to the list of the scene, with their overrides applied. Removes the
  /// names of the items from `unused`. Returns the number of items.
  std::size_t add_items(const Node& tree, std::string_view key, const Node* overrides,
                        std::vector<std::string>& unused) {
    const Node* items = tree.find(key);
    if (!items || !items->as<List>()) return 0;
    List* target = list_in(source_.root, key);
    for (Node item : *items->as<List>()) {
      const std::string name = text_of(item.find("name"));
      std::erase(unused, name);
      if (const Node* over = overrides ? overrides->find(name) : nullptr) merge(item, *over);
      target->push_back(std::move(item));
    }
    return items->as<List>()->size();
  }

  void add(const Node& effect, std::size_t i, std::vector<EffectParts>& all) {
    const std::string path = "/effects/" + std::to_string(i);
    const Node* key = effect.find("preset");
    const std::string name = text_of(key);
    const Node* tree = name.empty() ? nullptr : preset(name, *key, path + "/preset");
    if (!tree) return;
    const Node* overrides = effect.find("overrides");
    std::vector<std::string> unused;
    if (overrides && overrides->as<Object>())
      for (const Member& member : *overrides->as<Object>()) unused.push_back(member.key);
    EffectParts parts{.effect = i,
                      .first_emitter = list_in(source_.root, "emitters")->size(),
                      .first_force = list_in(source_.root, "forces")->size()};
    parts.emitters = add_items(*tree, "emitters", overrides, unused);
    parts.forces = add_items(*tree, "forces", overrides, unused);
    all.push_back(parts);
    std::vector<std::string> known = preset_names_in(tree->find("emitters"));
    for (const std::string& force : preset_names_in(tree->find("forces"))) known.push_back(force);
    for (const std::string& wrong : unused)
      fail(*overrides->find(wrong), path + "/overrides/" + wrong,
           "the preset '" + name + "' has no such emitter or force" + suggestion(wrong, known));
  }

  SceneSource& source_;
  const SceneFolder& folder_;
  std::vector<Problem>& problems_;
  std::map<std::string, Node> presets_;
};

void delay(Emitter& emitter, Real by) {
  constexpr Real kNever = 1e29;
  emitter.start += by;
  if (emitter.end < kNever) emitter.end += by;
  for (effects::Burst& burst : emitter.bursts) burst.time += by;
  for (effects::TimeWindow& window : emitter.windows) {
    window.start += by;
    if (window.end < kNever) window.end += by;
  }
}

void move_region(sim::Region& region, const Vec3& by) {
  std::visit(
      [&](auto& r) {
        if constexpr (requires { r.centre; }) r.centre += by;
      },
      region);
}

void place(Force& force, const Effect& effect, const std::string& prefix) {
  std::visit(
      [&](auto& f) {
        f.name = prefix + f.name;
        if constexpr (requires { f.particles; })
          for (std::string& name : f.particles) name = prefix + name;
        const Vec3& by = effect.position;
        if constexpr (requires { f.region; }) move_region(f.region, by);
        if constexpr (requires { f.keyframes; }) {
          for (auto& key : f.keyframes) {
            key.time += effect.start;
            if constexpr (requires { key.position; }) key.position += by;
          }
        } else if constexpr (requires { f.point; }) {
          f.point += by;
        }
        if constexpr (requires { f.time; })
          f.time += effect.start;
        else
          f.start += effect.start, f.end += effect.start;
      },
      force);
}

}  // namespace

fs::path presets_folder() {
  std::error_code error;
  if (const char* given = std::getenv("OFFSTAGE_PRESETS"); given && fs::is_directory(given, error))
    return given;
  return shipped_folder("presets", "effects/presets");
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  const fs::path folder = presets_folder();
  if (folder.empty()) return names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

fs::path preset_file(const std::string& name, const SceneFolder& scene_folder) {
  if (name.ends_with(".json")) return (scene_folder / name).lexically_normal();
  const std::vector<std::string> names = preset_names();
  if (std::ranges::find(names, name) == names.end())
    throw SceneError(Where{}, "there is no preset '" + name + "'" + suggestion(name, names));
  return presets_folder() / (name + ".json");
}

std::string preset_description(const std::string& name) {
  const fs::path file = preset_file(name);
  return text_of(parse_json(read_text(file), file.string()).find("description"));
}

std::vector<EffectParts> apply_presets(SceneSource& source, const SceneFolder& folder,
                                       std::vector<Problem>& problems) {
  if (!source.root.as<Object>()) return {};
  Layer layer(source, folder, problems);
  layer.lay_under_emitters();
  return layer.add_effects();
}

void place_effects(Scene& scene, const std::vector<EffectParts>& all) {
  for (const EffectParts& parts : all) {
    if (parts.effect >= scene.effects.size()) continue;
    const Effect& effect = scene.effects[parts.effect];
    const std::string prefix =
        (effect.name.empty() ? fs::path(effect.preset).stem().string() : effect.name) + "/";
    for (std::size_t i = 0; i < parts.emitters; ++i) {
      if (parts.first_emitter + i >= scene.emitters.size()) break;
      Emitter& emitter = scene.emitters[parts.first_emitter + i];
      emitter.name = prefix + emitter.name;
      if (emitter.body.empty()) emitter.body = effect.body;
      position_of(emitter.surface) += effect.position;
      delay(emitter, effect.start);
    }
    for (std::size_t i = 0; i < parts.forces; ++i)
      if (parts.first_force + i < scene.forces.size())
        place(scene.forces[parts.first_force + i], effect, prefix);
  }
  scene.effects.clear();
  for (Emitter& emitter : scene.emitters) emitter.preset.clear();
}

}  // namespace offstage::producer
