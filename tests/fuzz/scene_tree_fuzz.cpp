// Scenes of the gallery with changed values: keys and structure stay those of a scene, numbers, texts and
// places in lists change. Accepted scenes are simulated for a few frames; a state that is not finite must be
// reported.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "producer/base/json.h"
#include "producer/build/models.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "producer/format/scene_source.h"

namespace {

using namespace offstage::producer;

const std::vector<Node>& gallery() {
  static const std::vector<Node> scenes = [] {
    std::vector<Node> all;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(OFFSTAGE_SOURCE_DIR "/demos/scenes"))
      if (entry.path().extension() == ".json") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const auto& file : files) all.push_back(parse_json(read_text(file), file.string()));
    return all;
  }();
  return scenes;
}

/// Turns the bytes of the fuzzer into choices; 0 when they are used up.
class Choices {
 public:
  Choices(const uint8_t* data, size_t size) : data_(data), size_(size) {}
  size_t below(size_t n) {
    size_t value = 0;
    for (int i = 0; i < 2; ++i) value = value << 8 | (at_ < size_ ? data_[at_++] : 0);
    return n > 0 ? value % n : 0;
  }
  bool empty() const { return at_ >= size_; }

 private:
  const uint8_t* data_;
  size_t size_, at_ = 0;
};

void collect(Node& node, std::vector<Node*>& all) {
  all.push_back(&node);
  if (List* list = node.as<List>())
    for (Node& item : *list) collect(item, all);
  if (Object* object = node.as<Object>())
    for (Member& member : *object) collect(member.value, all);
}

void mutate(Node& root, Choices& choices) {
  std::vector<Node*> all;
  collect(root, all);
  Node& node = *all[choices.below(all.size())];
  static constexpr double kNumbers[] = {0,    1,     -1,    0.5,    1e-300, 1e-9, 1e9,   1e30,  1e39,
                                        1e80, 1e154, 1e300, -1e300, 2,      3,    1e-30, 1e-39, 1000};
  switch (choices.below(6)) {
    case 0:
    case 1:
      if (node.as<double>() || node.as<int64_t>()) node.value = kNumbers[choices.below(std::size(kNumbers))];
      break;
    case 2:
      if (auto* number = node.as<double>()) *number *= static_cast<double>(choices.below(4096)) / 256;
      break;
    case 3:
      if (List* list = node.as<List>(); list && !list->empty())
        list->push_back((*list)[choices.below(list->size())]);
      break;
    case 4:
      if (List* list = node.as<List>(); list && !list->empty())
        list->erase(list->begin() + static_cast<std::ptrdiff_t>(choices.below(list->size())));
      break;
    default:
      if (Object* object = node.as<Object>(); object && !object->empty())
        object->erase(object->begin() + static_cast<std::ptrdiff_t>(choices.below(object->size())));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Choices choices(data, size);
  Node scene = gallery()[choices.below(gallery().size())];
  constexpr int kMostMutations = 16;
  for (int i = 0; i < kMostMutations && !choices.empty(); ++i) mutate(scene, choices);
  const std::string text = to_text(scene);
  // Models would be decomposed into convex parts in each run, which takes seconds; decomposition_fuzz.cpp
  // does that.
  if (text.find("/models/") != std::string::npos) return 0;
  try {
    const LoadedScene loaded =
        parse_scene(text, "fuzz.json", OFFSTAGE_SOURCE_DIR "/demos/scenes", {"output.duration=0.1"});
    // One run should take a moment.
    constexpr std::size_t kMostBodies = 100;
    constexpr int kMostCells = 400;
    const auto is_large = [](const Cloth& cloth) {
      const GridShape* grid = std::get_if<GridShape>(&cloth.shape);
      return !grid || grid->cells.prod() > kMostCells;
    };
    if (loaded.scene.bodies.size() > kMostBodies || !loaded.scene.emitters.empty() ||
        std::ranges::any_of(loaded.scene.cloths, is_large))
      return 0;
    std::vector<offstage::Problem> warnings;
    const ModelLibrary models(loaded.scene, loaded.folder, DecompositionCache(), warnings);
    Simulation simulation(loaded.scene, models);
    for (int frame = 0; frame < 2; ++frame) simulation.advance();
    simulation.energy();
  } catch (const offstage::SceneError&) {
  } catch (const DivergedError&) {
  }
  return 0;
}
