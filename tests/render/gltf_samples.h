#pragma once
/// Small glTF files for the tests, built member by member: a square of 2 m in the plane z = 0 that faces +Z.

#include <cstring>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace offstage::render {

using Json = nlohmann::json;

inline std::string base64_of(const std::vector<uint8_t>& bytes) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const uint32_t a = bytes[i], b = i + 1 < bytes.size() ? bytes[i + 1] : 0u,
                   c = i + 2 < bytes.size() ? bytes[i + 2] : 0u;
    const uint32_t word = a << 16 | b << 8 | c;
    for (uint32_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

inline std::vector<uint8_t> base64_bytes(const std::string& text) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<uint8_t> bytes;
  uint32_t word = 0, bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    word = word << 6 | static_cast<uint32_t>(kDigits.find(c));
    bits += 6;
    if (bits >= 8) bytes.push_back(static_cast<uint8_t>(word >> (bits -= 8)));
  }
  return bytes;
}

enum GltfType { kInt8 = 5120, kUint8, kInt16, kUint16, kUint32 = 5125, kFloat32 };

template <class T>
constexpr int gltf_type() {
  if constexpr (std::is_same_v<T, float>) return kFloat32;
  if constexpr (std::is_same_v<T, int8_t>) return kInt8;
  if constexpr (std::is_same_v<T, uint8_t>) return kUint8;
  if constexpr (std::is_same_v<T, int16_t>) return kInt16;
  if constexpr (std::is_same_v<T, uint16_t>) return kUint16;
  return kUint32;
}

/// A glTF file in preparation. Tests may change `document` in any way before they call text().
class GltfSample {
 public:
  GltfSample() {
    document = {{"asset", {{"version", "2.0"}}},
                {"scene", 0},
                {"scenes", {{{"nodes", {0}}}}},
                {"nodes", {{{"mesh", 0}}}},
                {"meshes", {{{"primitives", {{{"attributes", Json::object()}, {"material", 0}}}}}}},
                {"materials", {{{"name", "m"}}}}};
    set("POSITION", std::vector<float>{-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, "VEC3");
    set("NORMAL", std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    set("TEXCOORD_0", std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0}, "VEC2");
    primitive()["indices"] = accessor(std::vector<uint16_t>{0, 1, 2, 0, 2, 3}, "SCALAR");
  }

  Json& primitive() { return document["meshes"][0]["primitives"][0]; }
  Json& material() { return document["materials"][0]; }
  Json& pbr() { return material()["pbrMetallicRoughness"]; }
  Json& extension(const char* name) {
    document["extensionsUsed"].push_back(name);
    return material()["extensions"][name] = Json::object();
  }
  /// Makes the material unlit, so that its colour is shown unchanged.
  void make_unlit() { extension("KHR_materials_unlit"); }

  template <class T>
  int view(const std::vector<T>& values, int stride = 0) {
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    Json entry = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", values.size() * sizeof(T)}};
    if (stride > 0) entry["byteStride"] = stride;
    const auto* data = reinterpret_cast<const uint8_t*>(values.data());
    bytes.insert(bytes.end(), data, data + values.size() * sizeof(T));
    document["bufferViews"].push_back(entry);
    return static_cast<int>(document["bufferViews"].size() - 1);
  }
  template <class T>
  int accessor(const std::vector<T>& values, const std::string& type, bool normalized = false) {
    const std::size_t width = type == "SCALAR" ? 1
                              : type == "MAT4" ? 16
                                               : static_cast<std::size_t>(type[3] - '0');
    Json entry = {{"bufferView", view(values)},
                  {"componentType", gltf_type<T>()},
                  {"count", values.size() / width},
                  {"type", type}};
    if (normalized) entry["normalized"] = true;
    return add_accessor(entry);
  }
  int add_accessor(const Json& entry) {
    document["accessors"].push_back(entry);
    return static_cast<int>(document["accessors"].size() - 1);
  }
  template <class T>
  void set(const char* attribute, const std::vector<T>& values, const std::string& type,
           bool normalized = false) {
    primitive()["attributes"][attribute] = accessor(values, type, normalized);
  }
  /// Adds a texture with an encoded PNG image and returns its index.
  int texture(const std::vector<uint8_t>& encoded, const Json& sampler = Json::object()) {
    document["images"].push_back({{"uri", "data:image/png;base64," + base64_of(encoded)}});
    document["samplers"].push_back(sampler);
    document["textures"].push_back(
        {{"source", document["images"].size() - 1}, {"sampler", document["samplers"].size() - 1}});
    return static_cast<int>(document["textures"].size() - 1);
  }

  std::string text() const {
    Json whole = document;
    whole["buffers"] = {
        {{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64_of(bytes)}}};
    return whole.dump();
  }

  Json document;
  std::vector<uint8_t> bytes;
};

}  // namespace offstage::render
