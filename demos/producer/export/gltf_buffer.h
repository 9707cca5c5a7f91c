#pragma once
/// Private: the binary buffer of a glTF file.

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "producer/export/spool.h"
#include "render/error.h"

namespace offstage::producer {

// Constants of the format: usage of a buffer view.
inline constexpr int kGltfVertices = 34962, kGltfIndices = 34963;

/// The binary buffer of a file, and the accessors that refer to it.
class GltfBuffer {
 public:
  explicit GltfBuffer(const std::filesystem::path& file) : file_(file), spool_(file.parent_path()) {}

  /// Adds data and returns the index of its accessor. `target`: usage of the data, as a glTF constant; 0:
  /// neither vertices nor indices.
  int add(std::span<const float> numbers, int width, int target = 0, bool with_bounds = false) {
    const char* type = width == 1 ? "SCALAR" : width == 2 ? "VEC2" : width == 3 ? "VEC3" : "VEC4";
    nlohmann::ordered_json accessor = {{"bufferView", add_view(bytes_of(numbers), target)},
                                       {"componentType", kFloat},
                                       {"count", numbers.size() / static_cast<std::size_t>(width)},
                                       {"type", type}};
    if (with_bounds) add_bounds(numbers, static_cast<std::size_t>(width), accessor);
    accessors.push_back(std::move(accessor));
    return static_cast<int>(accessors.size()) - 1;
  }
  int add(std::span<const Eigen::Vector3f> vectors, int target, bool with_bounds = false) {
    return add({vectors.empty() ? nullptr : vectors[0].data(), 3 * vectors.size()}, 3, target, with_bounds);
  }
  int add_indices(std::span<const uint32_t> indices) {
    accessors.push_back({{"bufferView", add_view(bytes_of(indices), kGltfIndices)},
                         {"componentType", kUnsignedInt},
                         {"count", indices.size()},
                         {"type", "SCALAR"}});
    return static_cast<int>(accessors.size()) - 1;
  }
  int add_view(std::span<const uint8_t> bytes, int target = 0) {
    nlohmann::ordered_json view = {
        {"buffer", 0}, {"byteOffset", spool_.size()}, {"byteLength", bytes.size()}};
    if (target != 0) view["target"] = target;
    views.push_back(std::move(view));
    spool_.append(bytes);
    constexpr std::array<uint8_t, 4> kZero{};
    spool_.append(std::span(kZero).first((4 - bytes.size() % 4) % 4));
    if (spool_.size() > std::numeric_limits<uint32_t>::max() - (1u << 28))
      throw render::FileError(file_.string() +
                              ": a .glb file holds 4 GiB at most; export fewer frames, or .usda");
    return static_cast<int>(views.size()) - 1;
  }
  Spool& spool() { return spool_; }

  nlohmann::ordered_json views = nlohmann::ordered_json::array(), accessors = nlohmann::ordered_json::array();

 private:
  static constexpr int kFloat = 5126, kUnsignedInt = 5125;  // types of numbers

  template <class T>
  static std::span<const uint8_t> bytes_of(std::span<const T> values) {
    return {reinterpret_cast<const uint8_t*>(values.data()), values.size_bytes()};
  }
  static void add_bounds(std::span<const float> numbers, std::size_t width,
                         nlohmann::ordered_json& accessor) {
    std::vector<float> least(width, std::numeric_limits<float>::max()), most(width, -least[0]);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      least[i % width] = std::min(least[i % width], numbers[i]);
      most[i % width] = std::max(most[i % width], numbers[i]);
    }
    accessor["min"] = least;
    accessor["max"] = most;
  }

  std::filesystem::path file_;
  Spool spool_;
};

}  // namespace offstage::producer
