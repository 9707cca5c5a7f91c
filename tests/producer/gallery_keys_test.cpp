/// Every key of the scene format occurs in a scene of the gallery, so that a golden tests its effect.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

using nlohmann::json;

/// Keys that no scene of the gallery can show, and why.
const std::map<std::string, std::string> kUnseenKeys = {
    {"$schema", "tells an editor where the schema lies; the loader ignores it"},
};

/// A key with its help. Tables that share a part, such as all forces, share the help of its keys.
using GalleryKey = std::pair<std::string, std::string>;

class GalleryKeys {
 public:
  explicit GalleryKeys(const json& schema) : schema_(schema) {
    all_of(schema);
    for (const auto& [name, rule] : schema["definitions"].items()) all_of(rule);
  }

  /// Records the keys of a value. The schema says which object of the format the value is.
  void see(const json& value, const json& given) {
    const json& rule = resolve(given);
    for (const char* choice : {"oneOf", "anyOf"})
      if (rule.contains(choice))
        for (const json& option : rule[choice])
          if (fits(value, resolve(option))) see(value, option);
    if (value.is_array() && rule.contains("items") && rule["items"].is_object())
      for (const json& element : value) see(element, rule["items"]);
    if (!value.is_object() || !rule.contains("properties")) return;
    for (const auto& [key, part] : value.items()) {
      const auto property = rule["properties"].find(key);
      if (property == rule["properties"].end()) continue;
      seen_.insert(key_of(key, *property));
      see(part, *property);
    }
  }

  std::set<GalleryKey> unseen() const {
    std::set<GalleryKey> left;
    for (const GalleryKey& key : all_)
      if (!seen_.contains(key)) left.insert(key);
    return left;
  }
  std::size_t count() const { return all_.size(); }

 private:
  static GalleryKey key_of(const std::string& key, const json& rule) {
    return {key, rule.value("description", rule.dump())};
  }
  void all_of(const json& rule) {
    if (!rule.contains("properties")) return;
    for (const auto& [key, part] : rule["properties"].items()) all_.insert(key_of(key, part));
  }
  const json& resolve(const json& rule) const {
    constexpr std::string_view kAt = "#/definitions/";
    return rule.contains("$ref")
               ? resolve(schema_["definitions"][rule["$ref"].get<std::string>().substr(kAt.size())])
               : rule;
  }
  /// Returns whether a value belongs to one of the alternatives of the schema: if the alternatives have
  /// types, the `type` must be equal.
  static bool fits(const json& value, const json& option) {
    if (!value.is_object() || !option.contains("properties")) return value.is_object() || value.is_array();
    const auto type = option["properties"].find("type");
    if (type == option["properties"].end() || !type->contains("const")) return true;
    const bool is_first = !option.contains("required") ||
                          std::ranges::find(option["required"], "type") == option["required"].end();
    return value.contains("type") ? value["type"] == (*type)["const"] : is_first;
  }

  const json& schema_;
  std::set<GalleryKey> all_, seen_;
};

TEST(GalleryKeys, AreAllUsedByAScene) {
  const json schema = json::parse(scene_schema());
  GalleryKeys keys(schema);
  ASSERT_GT(keys.count(), 300u);
  for (const auto& entry : std::filesystem::directory_iterator(OFFSTAGE_SOURCE_DIR "/demos/scenes")) {
    if (entry.path().extension() != ".json") continue;
    std::ifstream file(entry.path());
    keys.see(json::parse(file, nullptr, true, true), schema);
  }
  std::set<std::string> excused;
  for (const auto& [key, help] : keys.unseen()) {
    if (kUnseenKeys.contains(key))
      excused.insert(key);
    else
      ADD_FAILURE() << "no scene in demos/scenes uses '" << key << "': " << help;
  }
  for (const auto& [key, reason] : kUnseenKeys)
    EXPECT_TRUE(excused.contains(key)) << "'" << key << "' is used and needs no exception";
}

}  // namespace
}  // namespace offstage::producer
