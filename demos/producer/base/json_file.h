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

/// An object in a JSON file of offstage. The functions return the given default for a missing key. They throw
/// render::FileError for a value of the wrong type, such as "FILE: /key: must be a text, got 3".
class JsonObject {
 public:
  JsonObject(std::filesystem::path file, std::string path, nlohmann::json json)
      : file_(std::move(file)), path_(std::move(path)), json_(std::move(json)) {}

  bool has(const std::string& key) const { return json_.contains(key); }
  std::string text(const std::string& key, const std::string& otherwise = {}) const;
  bool flag(const std::string& key, bool otherwise) const;
  /// Returns an integer from 0 to `most`; `otherwise` if the key is missing.
  int count(const std::string& key, int otherwise, int most) const;
  /// Returns the objects of a list; none if the key is missing.
  std::vector<JsonObject> objects(const std::string& key) const;
  /// Returns a value of any type; null if the key is missing.
  nlohmann::json value(const std::string& key) const;

  /// Throws render::FileError: the value of `key` must be `allowed`.
  [[noreturn]] void refuse(const std::string& key, const std::string& allowed) const;
  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  std::string path_;
  nlohmann::json json_;
};

/// Reads a JSON file. Returns nothing if the file does not exist or does not contain a JSON object. Throws
/// render::FileError if it cannot be read or is not a regular file.
std::optional<JsonObject> read_json_file(const std::filesystem::path& file);

}  // namespace offstage::producer
