#pragma once
/// JSON files written by offstage: goldens, caches, manifests. A value of the wrong type is an error with the
/// file and the key.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace offstage::producer {

/// Greatest number of frames in a JSON file of offstage.
inline constexpr int kMostFrames = 1'000'000'000;

/// An object in a JSON file of offstage. A missing key has its default; a value of the wrong type throws
/// render::FileError "FILE: /key: must be a text, got 3".
class JsonObject {
 public:
  JsonObject(std::filesystem::path file, std::string path, nlohmann::json json)
      : file_(std::move(file)), path_(std::move(path)), json_(std::move(json)) {}

  bool has(const std::string& key) const { return json_.contains(key); }
  std::string text(const std::string& key, const std::string& otherwise = {}) const;
  bool flag(const std::string& key, bool otherwise) const;
  /// Returns an integer from 0 to `most`; `otherwise` if the key is missing.
  int count(const std::string& key, int otherwise, int most) const;
  /// The objects of a list; none if the key is missing.
  std::vector<JsonObject> objects(const std::string& key) const;
  /// The value without a check of its type; null if it is missing.
  nlohmann::json value(const std::string& key) const;

  [[noreturn]] void refuse(const std::string& key, const std::string& allowed) const;
  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  std::string path_;
  nlohmann::json json_;
};

/// Reads such a file; nothing if there is no file, or if its content is not an object. Throws
/// render::FileError for a file that cannot be read or is not regular.
std::optional<JsonObject> read_json_file(const std::filesystem::path& file);

}  // namespace offstage::producer
