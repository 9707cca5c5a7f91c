#pragma once
/// Private: checked access to the JSON of a glTF document. A value of a wrong type or out of range throws
/// FileError with its place, as in "nodes[3].mesh: must be an index below 2".

#include <cmath>
#include <optional>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "render/error.h"

namespace offstage::render {

/// An object of the document with its place. A missing object is empty, so all its members have their
/// defaults.
class GltfValue {
 public:
  using Json = nlohmann::json;
  GltfValue(const Json* json, std::string place) : json_(json), place_(std::move(place)) {
    if (json_ != nullptr && !json_->is_object()) throw FileError(place_ + ": must be an object");
  }

  const std::string& place() const { return place_; }
  bool exists() const { return json_ != nullptr; }
  const Json* json() const { return json_; }
  bool has(const char* key) const { return find(key) != nullptr; }
  /// Returns a member that is an object; an empty object if the member is missing.
  GltfValue child(const char* key) const { return {find(key), place_ + "." + key}; }
  GltfValue extension(const char* name) const { return child("extensions").child(name); }

  /// Returns the length of a list; 0 if the list is missing.
  std::size_t count(const char* key) const {
    const Json* list = find(key);
    if (list != nullptr && !list->is_array()) throw wrong(key, "must be a list");
    return list == nullptr ? 0 : list->size();
  }
  GltfValue item(const char* key, std::size_t i) const {
    if (i >= count(key)) throw wrong(key, "has no entry " + std::to_string(i));
    return {&(*find(key))[i], place_ + (place_.empty() ? "" : ".") + key + "[" + std::to_string(i) + "]"};
  }

  double number(const char* key, double missing) const {
    const Json* value = find(key);
    return value == nullptr ? missing : to_number(*value, key);
  }
  /// Returns a whole number in [0, 2^53].
  std::size_t size(const char* key, std::size_t missing) const {
    const Json* value = find(key);
    return value == nullptr ? missing : to_size(*value, key);
  }
  bool flag(const char* key) const {
    const Json* value = find(key);
    if (value != nullptr && !value->is_boolean()) throw wrong(key, "must be true or false");
    return value != nullptr && value->get<bool>();
  }
  std::string text(const char* key, const std::string& missing = {}) const {
    const Json* value = find(key);
    if (value != nullptr && !value->is_string()) throw wrong(key, "must be a string");
    return value == nullptr ? missing : value->get<std::string>();
  }
  /// Returns an index into a list of `limit` entries.
  std::optional<std::size_t> index(const char* key, std::size_t limit) const {
    const Json* value = find(key);
    if (value == nullptr) return std::nullopt;
    return checked_index(*value, key, limit);
  }
  std::size_t index_at(const char* key, std::size_t i, std::size_t limit) const {
    if (i >= count(key)) throw wrong(key, "has no entry " + std::to_string(i));
    return checked_index((*find(key))[i], key, limit);
  }
  double number_at(const char* key, std::size_t i) const {
    if (i >= count(key)) throw wrong(key, "has no entry " + std::to_string(i));
    return to_number((*find(key))[i], key);
  }
  /// Returns a list of exactly N finite numbers.
  template <int N>
  Eigen::Matrix<double, N, 1> numbers(const char* key, const Eigen::Matrix<double, N, 1>& missing) const {
    if (!has(key)) return missing;
    if (count(key) != static_cast<std::size_t>(N))
      throw wrong(key, "must have " + std::to_string(N) + " numbers");
    Eigen::Matrix<double, N, 1> result;
    for (int i = 0; i < N; ++i) result[i] = number_at(key, static_cast<std::size_t>(i));
    return result;
  }
  FileError wrong(const std::string& key, const std::string& why) const {
    return FileError(place_ + (place_.empty() ? "" : ".") + key + ": " + why);
  }

 private:
  const Json* find(const char* key) const {
    if (json_ == nullptr) return nullptr;
    const auto found = json_->find(key);
    return found == json_->end() ? nullptr : &*found;
  }
  double to_number(const Json& value, const char* key) const {
    if (!value.is_number() || !std::isfinite(value.get<double>())) throw wrong(key, "must be a number");
    return value.get<double>();
  }
  std::size_t to_size(const Json& value, const char* key) const {
    const double number = to_number(value, key);
    if (number < 0 || number > 9007199254740992.0 || number != std::floor(number))
      throw wrong(key, "must be a whole number of at least 0");
    return static_cast<std::size_t>(number);
  }
  std::size_t checked_index(const Json& value, const char* key, std::size_t limit) const {
    const std::size_t index = to_size(value, key);
    if (index >= limit)
      throw wrong(key, "is " + std::to_string(index) + ", but must be below " + std::to_string(limit));
    return index;
  }

  const Json* json_;
  std::string place_;
};

}  // namespace offstage::render
