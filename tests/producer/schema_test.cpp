/// The schema, the loader and the reference are generated from one table; these tests check that they agree.

#include <fstream>
#include <functional>
#include <iterator>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "effects/random.h"
#include "producer/format/scene_io.h"
#include "producer/sample_scene.h"

namespace offstage::producer {
namespace {

using nlohmann::json;
using Adapter = valijson::adapters::NlohmannJsonAdapter;

class SceneSchema : public testing::Test {
 protected:
  SceneSchema() : schema_json(json::parse(scene_schema())) {
    valijson::SchemaParser(valijson::SchemaParser::kDraft7).populateSchema(Adapter(schema_json), schema);
  }

  bool schema_accepts(const json& scene) {
    return valijson::Validator().validate(schema, Adapter(scene), nullptr);
  }
  /// Paths of all problems that the loader reports; empty if it accepts the scene.
  static std::set<std::string> refused(const json& scene) {
    std::set<std::string> paths;
    try {
      parse_scene(scene.dump(), "scene", OFFSTAGE_SOURCE_DIR);
    } catch (const SceneError& error) {
      for (const Problem& problem : error.problems()) paths.insert(problem.where.path);
    }
    return paths;
  }

  /// A place in the format at which a value can stand.
  struct Slot {
    std::string path;
    std::function<json(const json&)> scene_with;
    json rule;  // the schema of the value
  };

  /// Returns whether a path leads into child particles of child particles, which is recursive.
  static bool is_deep(const std::string& path) {
    int lists = 0;
    for (std::size_t at = 0; (at = path.find("/0", at)) != std::string::npos; ++at) ++lists;
    return lists > 2;
  }

  const json& resolve(const json& rule) const {
    return rule.contains("$ref")
               ? schema_json.at(json::json_pointer(rule.at("$ref").get<std::string>().substr(1)))
               : rule;
  }

  /// Calls `leaf` for every key whose value is not an object, and `object` for every object, at all places
  /// where they can stand.
  void walk(const Slot& slot, const std::function<void(const Slot&)>& leaf,
            const std::function<void(const Slot&, const json& minimal)>& object) const {
    const json& rule = resolve(slot.rule);
    if (is_deep(slot.path)) {
      leaf({slot.path, slot.scene_with, rule});
    } else if (rule.contains("properties")) {
      walk_object(slot, rule, leaf, object);
    } else if (rule.contains("oneOf") && resolve(rule.at("oneOf")[0]).contains("properties") &&
               resolve(rule.at("oneOf")[0]).at("properties").contains("type")) {
      for (const json& alternative : rule.at("oneOf"))
        walk({slot.path, slot.scene_with, alternative}, leaf, object);
    } else {
      leaf({slot.path, slot.scene_with, rule});
      if (rule.contains("items") && resolve(rule.at("items")).is_object() && !rule.contains("minItems") &&
          (resolve(rule.at("items")).contains("properties") || resolve(rule.at("items")).contains("oneOf")))
        walk({slot.path + "/0", [&](const json& v) { return slot.scene_with(json::array({v})); },
              rule.at("items")},
             leaf, object);
    }
  }

  void walk_all(const std::function<void(const Slot&)>& leaf,
                const std::function<void(const Slot&, const json& minimal)>& object) const {
    walk({"", [](const json& v) { return v; }, schema_json}, leaf, object);
  }

  const json schema_json;
  valijson::Schema schema;

 private:
  void walk_object(const Slot& slot, const json& rule, const std::function<void(const Slot&)>& leaf,
                   const std::function<void(const Slot&, const json& minimal)>& object) const {
    json minimal = json::object();
    for (const json& key : rule.value("required", json::array())) {
      const json& value = resolve(rule.at("properties").at(key.get<std::string>()));
      minimal[key.get<std::string>()] = value.contains("minItems") ? json::array({"LICENSE", "LICENSE"})
                                        : value.value("type", "") == "array" ? json::array({"LICENSE"})
                                                                             : json("LICENSE");
    }
    if (rule.at("properties").value("/type/const"_json_pointer, "") != "")
      minimal["type"] = rule.at("properties").at("type").at("const");
    object(slot, minimal);
    for (const auto& [key, value] : rule.at("properties").items()) {
      if (key == "type" || key == "$schema" || key == "include") continue;
      const auto with = [&, key = key](const json& v) {
        json filled = minimal;
        filled[key] = v;
        return slot.scene_with(filled);
      };
      walk({slot.path + "/" + key, with, value}, leaf, object);
    }
  }
};

/// Returns a number outside the limits in `rule`, below or above.
std::optional<json> beyond(const json& rule, bool low) {
  if (low && rule.contains("minimum")) return rule.at("minimum").get<double>() - 1.5;
  if (low && rule.contains("exclusiveMinimum")) return rule.at("exclusiveMinimum");
  if (!low && rule.contains("maximum")) return rule.at("maximum").get<double>() * 2 + 1.5;
  if (!low && rule.contains("exclusiveMaximum")) return rule.at("exclusiveMaximum");
  return {};
}

TEST_F(SceneSchema, AcceptsTheSample) {
  const json sample = json::parse(kSampleScene, nullptr, true, true);
  EXPECT_TRUE(schema_accepts(sample));
  EXPECT_EQ(refused(sample), std::set<std::string>());
}

TEST_F(SceneSchema, AcceptsEveryCanonicalScene) {
  for (const char* text : {"{}", kSampleScene})
    EXPECT_TRUE(schema_accepts(json::parse(parse_scene(text, "scene", OFFSTAGE_SOURCE_DIR).canonical)));
}

TEST_F(SceneSchema, EveryKeyRefusesAWrongTypeByItsPathAsTheLoaderDoes) {
  int keys = 0;
  walk_all(
      [&](const Slot& slot) {
        ++keys;
        const bool boolean = slot.rule.value("type", "") == "boolean";
        for (const json& wrong : {json(boolean ? json("yes") : json(true)), json(nullptr)}) {
          const json scene = slot.scene_with(wrong);
          EXPECT_TRUE(refused(scene).contains(slot.path)) << slot.path << " " << scene;
          EXPECT_FALSE(schema_accepts(scene)) << slot.path << " " << scene;
        }
      },
      [&](const Slot& slot, const json&) {
        const json scene = slot.scene_with(7);
        EXPECT_TRUE(refused(scene).contains(slot.path)) << slot.path << " " << scene;
        EXPECT_FALSE(schema_accepts(scene)) << slot.path << " " << scene;
      });
  EXPECT_GT(keys, 200);
}

TEST_F(SceneSchema, EveryRangeRefusesValuesOutsideAsTheLoaderDoes) {
  int ranges = 0;
  walk_all(
      [&](const Slot& slot) {
        const bool varying =
            slot.rule.contains("oneOf") && slot.rule.at("oneOf")[0].value("type", "") == "number";
        const bool vector = slot.rule.contains("items") && slot.rule.contains("minItems");
        const json& number = varying ? slot.rule.at("oneOf")[0] : vector ? slot.rule.at("items") : slot.rule;
        for (const bool low : {true, false}) {
          if (number.is_array()) continue;
          const std::optional<json> bad = beyond(number, low);
          if (!bad) continue;
          ++ranges;
          const json value =
              vector ? json(std::vector<json>(slot.rule.at("minItems").get<std::size_t>(), *bad)) : *bad;
          const json scene = slot.scene_with(value);
          EXPECT_TRUE(refused(scene).contains(slot.path + (vector ? "/0" : ""))) << slot.path << " " << scene;
          EXPECT_FALSE(schema_accepts(scene)) << slot.path << " " << scene;
          if (!varying) continue;
          for (const json& form :
               {json{{"mean", *bad}}, json{{"range", {*bad, *bad}}}, json{{"curve", {{0, *bad}}}}}) {
            EXPECT_FALSE(refused(slot.scene_with(form)).empty()) << slot.path << " " << form;
            EXPECT_FALSE(schema_accepts(slot.scene_with(form))) << slot.path << " " << form;
          }
        }
      },
      [](const Slot&, const json&) {});
  EXPECT_GT(ranges, 90);
}

TEST_F(SceneSchema, EveryObjectRefusesUnknownKeysAsTheLoaderDoes) {
  int objects = 0;
  walk_all([](const Slot&) {},
           [&](const Slot& slot, json minimal) {
             ++objects;
             minimal["zzz"] = 1;
             const json scene = slot.scene_with(minimal);
             EXPECT_TRUE(refused(scene).contains(slot.path + "/zzz")) << scene;
             EXPECT_FALSE(schema_accepts(scene)) << scene;
           });
  EXPECT_GT(objects, 30);
}

TEST_F(SceneSchema, EveryDefaultItNamesIsTheLoaders) {
  walk_all(
      [&](const Slot& slot) {
        if (!slot.rule.contains("default")) return;
        const json scene = slot.scene_with(slot.rule.at("default"));
        EXPECT_TRUE(schema_accepts(scene)) << scene;
        EXPECT_FALSE(refused(scene).contains(slot.path)) << scene;
      },
      [](const Slot&, const json&) {});
  const json canonical = json::parse(parse_scene("{}", "scene", "").canonical);
  EXPECT_EQ(canonical.at("world").at("step"),
            schema_json.at("definitions").at("world").at("properties").at("step").at("default"));
}

/// Replaces a random value of a tree by an unusual one.
void disturb(json& tree, const effects::RandomStream& random, uint64_t seed) {
  static const std::vector<json> kOdd = {nullptr,
                                         true,
                                         -1,
                                         0,
                                         2,
                                         2.5,
                                         -0.5,
                                         "",
                                         "red",
                                         "#ff0000",
                                         "static",
                                         json::array(),
                                         json::object(),
                                         1e300,
                                         7,
                                         3,
                                         {1, 2, 3},
                                         {{"mean", 2}},
                                         {{"range", {1, 2}}},
                                         {{"type", "box"}},
                                         {{"type", "orbit"}}};
  const json flat = tree.flatten();
  auto place = flat.begin();
  std::advance(place, static_cast<std::ptrdiff_t>(random.below(flat.size(), seed, 0)));
  json::json_pointer pointer(place.key());
  for (uint64_t up = random.below(3, seed, 1); up > 0 && !pointer.parent_pointer().empty(); --up)
    pointer = pointer.parent_pointer();
  tree[pointer] = kOdd[random.below(kOdd.size(), seed, 2)];
}

TEST_F(SceneSchema, AcceptsAllThatTheLoaderAccepts) {
  const json sample = json::parse(kSampleScene, nullptr, true, true);
  const effects::RandomStream random(3, 1);
  int accepted = 0;
  for (uint64_t seed = 0; seed < 1500; ++seed) {
    json scene = sample;
    disturb(scene, random, seed);
    if (!refused(scene).empty()) continue;
    ++accepted;
    ASSERT_TRUE(schema_accepts(scene)) << scene;
  }
  EXPECT_GT(accepted, 50);
}

TEST(SceneReference, InTheDocumentationIsUpToDate) {
  std::ifstream file(OFFSTAGE_SOURCE_DIR "/docs/scene-format.md");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(text, scene_reference()) << "write the output of scene_reference() to docs/scene-format.md";
}

TEST(SceneReference, ItsExampleIsAValidScene) {
  const std::string text = scene_reference(), fence = "```json\n";
  const std::size_t begin = text.find(fence) + fence.size();
  EXPECT_TRUE(parse_scene(text.substr(begin, text.find("```", begin) - begin), "s", "").warnings.empty());
}

TEST(SceneReference, EveryLinkLeadsToAHeading) {
  const std::string text = scene_reference();
  for (std::size_t i = text.find("](#"); i != std::string::npos; i = text.find("](#", i + 1)) {
    std::string heading = text.substr(i + 3, text.find(')', i) - i - 3);
    std::set<std::string> forms = {"\n## " + heading + "\n"};
    for (char& c : heading) c = c == '-' ? ' ' : c;
    heading[0] = static_cast<char>(std::toupper(heading[0]));
    forms.insert("\n## " + heading + "\n");
    EXPECT_TRUE(std::any_of(forms.begin(), forms.end(), [&](const std::string& f) {
      return text.find(f) != text.npos;
    })) << heading;
  }
}

}  // namespace
}  // namespace offstage::producer
