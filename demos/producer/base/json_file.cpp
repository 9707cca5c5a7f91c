#include "producer/base/json_file.h"

#include "producer/base/scene_folder.h"
#include "render/error.h"
#include "render/file_io.h"

namespace offstage::producer {

std::string JsonObject::text(const std::string& key, const std::string& otherwise) const {
  const auto at = json_.find(key);
  if (at == json_.end()) return otherwise;
  if (!at->is_string()) refuse(key, "a text");
  return at->get<std::string>();
}

bool JsonObject::flag(const std::string& key, bool otherwise) const {
  const auto at = json_.find(key);
  if (at == json_.end()) return otherwise;
  if (!at->is_boolean()) refuse(key, "true or false");
  return at->get<bool>();
}

int JsonObject::count(const std::string& key, int otherwise, int most) const {
  const auto at = json_.find(key);
  if (at == json_.end()) return otherwise;
  if (!at->is_number_unsigned() || at->get<uint64_t>() > static_cast<uint64_t>(most))
    refuse(key, "a whole number from 0 to " + std::to_string(most));
  return at->get<int>();
}

std::vector<JsonObject> JsonObject::objects(const std::string& key) const {
  const auto at = json_.find(key);
  if (at == json_.end()) return {};
  if (!at->is_array()) refuse(key, "a list of objects");
  std::vector<JsonObject> all;
  for (const auto& item : *at) {
    const std::string path = path_ + "/" + key + "/" + std::to_string(all.size());
    if (!item.is_object())
      throw render::FileError(file_.string() + ": " + path + ": must be an object, got " + item.dump());
    all.emplace_back(file_, path, item);
  }
  return all;
}

nlohmann::json JsonObject::value(const std::string& key) const {
  const auto at = json_.find(key);
  return at == json_.end() ? nlohmann::json() : *at;
}

void JsonObject::refuse(const std::string& key, const std::string& allowed) const {
  constexpr std::size_t kLongest = 60;
  using nlohmann::json;
  std::string got =
      json_.contains(key) ? json_.at(key).dump(-1, ' ', true, json::error_handler_t::replace) : "nothing";
  if (got.size() > kLongest) got = got.substr(0, kLongest) + "...";
  throw render::FileError(render::escaped(file_.string()) + ": " + path_ + "/" + render::escaped(key) +
                          ": must be " + allowed + ", got " + got);
}

std::optional<JsonObject> read_json_file(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return {};
  const std::string text = render::read_text_file(file, kMostTextBytes);
  auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return {};
  return JsonObject(file, "", std::move(json));
}

}  // namespace offstage::producer
