#include "render/gltf_file.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "render/file_io.h"
#include "render/gltf_packed.h"
#include "render/model_files.h"

namespace offstage::render {
namespace {

constexpr uint64_t kMaxGltfBytes = uint64_t{2} << 30;
constexpr std::size_t kMaxGltfElements = std::size_t{1} << 28;  // far more than the memory of the reader
constexpr std::size_t kMaxGltfZeros = std::size_t{1} << 26;  // numbers of an accessor without a buffer view
constexpr std::size_t kMaxMeshoptRatio = 256;                // more than the codecs can reach
constexpr std::size_t kMaxGltfStride = 256;                  // 252 by the specification
constexpr std::size_t kMaxGltfWarnings = 100;
constexpr uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

enum GltfComponent { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

/// Extensions that are fully supported or do not change the picture.
constexpr std::array kGltfExtensions = {"KHR_mesh_quantization",
                                        "KHR_texture_transform",
                                        "KHR_materials_unlit",
                                        "KHR_materials_emissive_strength",
                                        "KHR_materials_transmission",
                                        "KHR_materials_ior",
                                        "KHR_materials_volume",
                                        "KHR_materials_clearcoat",
                                        "KHR_materials_sheen",
                                        "KHR_materials_specular",
                                        "KHR_materials_iridescence",
                                        "KHR_materials_pbrSpecularGlossiness",
                                        "EXT_mesh_gpu_instancing",
                                        "KHR_lights_punctual",
                                        "KHR_xmp_json_ld",
                                        "KHR_xmp"};

/// Extensions that need a library. `built`: whether the program was built with the library.
struct GltfLibrary {
  const char* extension;
  bool built;
  const char* package;
};
const std::array<GltfLibrary, 3>& gltf_libraries() {
  static const std::array<GltfLibrary, 3> libraries = {
      {{"KHR_draco_mesh_compression", has_draco(), "libdraco-dev"},
       {"EXT_meshopt_compression", has_meshopt(), "libmeshoptimizer-dev"},
       {"EXT_texture_webp", has_webp(), "libwebp-dev"}}};
  return libraries;
}

uint32_t little_endian(std::span<const uint8_t> bytes, std::size_t at) {
  return uint32_t{bytes[at]} | uint32_t{bytes[at + 1]} << 8 | uint32_t{bytes[at + 2]} << 16 |
         uint32_t{bytes[at + 3]} << 24;
}

template <class T>
T load_as(const uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

/// Returns one component as a number. Section 3.11 of the specification has the formulas for normalised
/// integers.
float gltf_component(const uint8_t* bytes, std::size_t type, bool normalized) {
  const auto scaled = [&](float value, float high) {
    return normalized ? std::max(value / high, -1.0f) : value;
  };
  switch (type) {
    case kByte:
      return scaled(load_as<int8_t>(bytes), 127);
    case kUnsignedByte:
      return scaled(*bytes, 255);
    case kShort:
      return scaled(load_as<int16_t>(bytes), 32767);
    case kUnsignedShort:
      return scaled(load_as<uint16_t>(bytes), 65535);
    case kUnsignedInt:
      return static_cast<float>(load_as<uint32_t>(bytes));
    default:
      return load_as<float>(bytes);
  }
}

/// Returns one component as an unsigned integer; 0 if it has another type.
uint32_t gltf_index(const uint8_t* bytes, std::size_t type, bool /*normalized*/) {
  switch (type) {
    case kUnsignedByte:
      return *bytes;
    case kUnsignedShort:
      return load_as<uint16_t>(bytes);
    case kUnsignedInt:
      return load_as<uint32_t>(bytes);
    default:
      return 0;
  }
}

std::size_t component_bytes(std::size_t type, const GltfValue& place) {
  switch (type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      throw place.wrong("componentType", "is " + std::to_string(type) + ", which glTF does not define");
  }
}

bool is_known_extension(const std::string& name) {
  return std::ranges::find(kGltfExtensions, name) != kGltfExtensions.end();
}

/// Returns the names of all extensions in a document. Application data (`extras`) are not searched.
std::set<std::string> extensions_within(const GltfValue::Json& document) {
  std::set<std::string> names;
  // A recursion would be unsafe, because the depth depends on the file.
  std::vector<const GltfValue::Json*> stack = {&document};
  while (!stack.empty()) {
    const GltfValue::Json& json = *stack.back();
    stack.pop_back();
    for (const auto& [key, value] : json.items()) {
      if (!value.is_structured() || (json.is_object() && key == "extras")) continue;
      if (json.is_object() && key == "extensions" && value.is_object())
        for (const auto& extension : value.items()) names.insert(extension.key());
      stack.push_back(&value);
    }
  }
  return names;
}

std::vector<uint8_t> base64_decoded(std::string_view text, const std::string& what) {
  std::vector<uint8_t> result;
  result.reserve(text.size() / 4 * 3);
  uint32_t word = 0;
  int bits = 0;
  for (const char c : text) {
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+' || c == '-' ? 62
                      : c == '/' || c == '_' ? 63
                                             : -1;
    if (c == '=') break;
    if (value < 0) throw FileError(what + ": is not valid base64");
    word = (word << 6 | static_cast<uint32_t>(value)) & 0xffffff;
    bits += 6;
    if (bits >= 8) result.push_back(static_cast<uint8_t>(word >> (bits -= 8)));
  }
  return result;
}

}  // namespace

/// The memory layout of an accessor.
struct GltfFile::Layout {
  std::size_t type = 0, count = 0;
  std::size_t width = 0;  ///< components per element
  std::size_t rows = 0;   ///< components per column of a matrix, else `width`
  std::size_t component = 0, column = 0,
              element = 0;  ///< sizes [bytes]; columns of matrices are aligned to 4
  bool normalized = false;

  std::size_t offset_of(std::size_t k) const { return k / rows * column + k % rows * component; }
};

bool is_gltf(const std::filesystem::path& path) {
  return has_ending(path, ".gltf") || has_ending(path, ".glb");
}

GltfFile::GltfFile(std::filesystem::path path, const InputFolders& folders)
    : path_(std::move(path)), folders_(folders) {
  load(read_file(path_, kMaxGltfBytes));
  if (!document_.is_object()) throw FileError("its JSON is not an object");
  root_ = GltfValue(&document_, "");
}

bool GltfFile::is_version_1() const {
  const GltfValue asset = root_.child("asset");
  const bool is_number =
      asset.has("version") && (*asset.json())["version"].is_number();  // only glTF 1.0 allows a number
  return is_number ? asset.number("version", 1) < 2 : asset.text("version", "1.0").starts_with("1.");
}

void GltfFile::check() {
  const GltfValue asset = root_.child("asset");
  const std::string version = asset.text("version"), least = asset.text("minVersion", "2.0");
  if (!version.starts_with("2."))
    throw FileError("asset.version is '" + one_line(version.substr(0, 20)) + "'; only 2.0 can be read");
  if (least != "2.0")
    throw FileError("it needs glTF " + one_line(least.substr(0, 20)) + "; only 2.0 can be read");
  check_extensions();
}

void GltfFile::load(std::vector<uint8_t> bytes) {
  const auto parse = [](std::span<const uint8_t> text) {
    try {
      return GltfValue::Json::parse(text.begin(), text.end());
    } catch (const GltfValue::Json::exception& error) {
      throw FileError("its JSON is broken: " + one_line(error.what()));
    }
  };
  const std::span<const uint8_t> all(bytes);
  if (all.size() < 12 || little_endian(all, 0) != kGlbMagic) {
    document_ = parse(all);
    return;
  }
  if (little_endian(all, 4) != 2) {
    document_ = {{"asset", {{"version", std::to_string(little_endian(all, 4)) + ".0"}}}};
    return;
  }
  bool has_document = false;
  for (std::size_t at = 12; all.size() - at >= 8;) {  // section 4.4
    const std::size_t length = little_endian(all, at);
    const uint32_t type = little_endian(all, at + 4);
    if (length > all.size() - at - 8) throw FileError("a chunk is longer than the file");
    const std::span<const uint8_t> chunk = all.subspan(at + 8, length);
    if (type == kJsonChunk && !has_document) document_ = parse(chunk);
    has_document |= type == kJsonChunk;
    if (type == kBinaryChunk && !has_binary_) binary_.assign(chunk.begin(), chunk.end());
    has_binary_ |= type == kBinaryChunk;
    at += 8 + std::min((length + 3) / 4 * 4, all.size() - at - 8);
  }
  if (!has_document) throw FileError("it has no JSON chunk");
}

void GltfFile::check_extensions() {
  const auto names = [this](const char* key) {
    std::vector<std::string> result;
    for (std::size_t i = 0; i < root_.count(key); ++i) {
      const GltfValue::Json& name = document_[key][i];
      if (!name.is_string()) throw root_.wrong(key, "must be a list of names");
      result.push_back(name.get<std::string>());
    }
    return result;
  };
  for (const std::string& name : names("extensionsRequired")) {
    const auto library = std::ranges::find(gltf_libraries(), name, &GltfLibrary::extension);
    if (library != gltf_libraries().end() && !library->built)
      throw FileError("it requires the extension " + name + ", and this program was built without " +
                      library->package);
    if (library == gltf_libraries().end() && !is_known_extension(name))
      throw FileError("it requires the extension " + name + ", which is not supported");
  }
  const std::vector<std::string> listed = names("extensionsUsed");
  std::set<std::string> used(listed.begin(), listed.end());
  used.merge(extensions_within(document_));  // not all programs list the extensions that they use
  for (const std::string& name : used) {
    const auto library = std::ranges::find(gltf_libraries(), name, &GltfLibrary::extension);
    if (library != gltf_libraries().end() && !library->built)
      warn("extension " + name + " is ignored: this program was built without " + library->package);
    else if (library == gltf_libraries().end() && !is_known_extension(name))
      warn("extension " + one_line(name) + " is not supported and is ignored");
  }
}

void GltfFile::warn(const std::string& line) {
  constexpr std::size_t kMostCharacters = 300;
  const std::string text = one_line(line.substr(0, kMostCharacters));
  if (warned_.size() <= kMaxGltfWarnings && warned_.insert(text).second)
    warnings_.push_back(warned_.size() > kMaxGltfWarnings ? "further warnings are omitted" : text);
}

std::vector<uint8_t> GltfFile::resource(const std::string& uri, const std::string& what) const {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos) throw FileError(what + ": its data: URI has no data");
    const std::string_view head = std::string_view(uri).substr(0, comma);
    if (!head.ends_with(";base64")) throw FileError(what + ": its data: URI is not in base64");
    return base64_decoded(std::string_view(uri).substr(comma + 1), what);
  }
  const std::filesystem::path file = find_beside(path_.parent_path(), uri);
  if (file.empty()) throw FileError(what + ": '" + one_line(uri.substr(0, 200)) + "' does not exist");
  if (!folders_.contain(file))
    throw FileError(what + ": '" + one_line(uri.substr(0, 200)) +
                    "' is outside of the folders that may be read");
  return read_file(file, kMaxGltfBytes);
}

const std::vector<uint8_t>& GltfFile::buffer(std::size_t index) {
  const auto found = buffers_.find(index);
  if (found != buffers_.end()) return found->second;
  const GltfValue entry = item("buffers", index);
  const std::size_t length = entry.size("byteLength", 0);
  std::vector<uint8_t> bytes;
  if (entry.has("uri"))
    bytes = resource(entry.text("uri"), entry.place());
  else if (index == 0 && has_binary_)
    bytes = binary_;
  else
    throw FileError(entry.place() + ": has no \"uri\", and the file has no binary chunk");
  if (bytes.size() < length)
    throw FileError(entry.place() + ": has " + std::to_string(bytes.size()) + " of " +
                    std::to_string(length) + " bytes");
  return buffers_.emplace(index, std::move(bytes)).first->second;
}

std::span<const uint8_t> GltfFile::range(std::size_t index, std::size_t offset, std::size_t length,
                                         const std::string& place) {
  const std::vector<uint8_t>& bytes = buffer(index);
  if (offset > bytes.size() || length > bytes.size() - offset)
    throw FileError(place + ": goes beyond its buffer");
  return std::span(bytes).subspan(offset, length);
}

std::span<const uint8_t> GltfFile::view(std::size_t index) {
  const GltfValue entry = item("bufferViews", index);
  const GltfValue compressed = entry.extension("EXT_meshopt_compression");
  if (compressed.exists() && has_meshopt()) {
    const auto found = unpacked_.find(index);
    if (found != unpacked_.end()) return found->second;
    return unpacked_.emplace(index, unpack(compressed)).first->second;
  }
  const std::optional<std::size_t> source = entry.index("buffer", count("buffers"));
  if (!source) throw entry.wrong("buffer", "is missing");
  return range(*source, entry.size("byteOffset", 0), entry.size("byteLength", 0), entry.place());
}

std::vector<uint8_t> GltfFile::unpack(const GltfValue& compressed) {
  const std::optional<std::size_t> source = compressed.index("buffer", count("buffers"));
  if (!source) throw compressed.wrong("buffer", "is missing");
  const std::span<const uint8_t> packed =
      range(*source, compressed.size("byteOffset", 0), compressed.size("byteLength", 0), compressed.place());
  const std::size_t elements = compressed.size("count", 0), stride = compressed.size("byteStride", 0);
  if (elements > kMaxGltfElements || stride > kMaxGltfStride)
    throw FileError(compressed.place() + ": is too large");
  if (elements * stride > packed.size() * kMaxMeshoptRatio)
    throw FileError(compressed.place() + ": is larger than its compressed data can be");
  return unpack_meshopt({.mode = compressed.text("mode"),
                         .filter = compressed.text("filter", "NONE"),
                         .count = elements,
                         .stride = stride,
                         .place = compressed.place()},
                        packed);
}

GltfFile::Layout GltfFile::layout(const GltfValue& accessor) const {
  struct Shape {
    const char* name;
    std::size_t width, rows;
  };
  constexpr std::array<Shape, 7> kShapes = {{{"SCALAR", 1, 1},
                                             {"VEC2", 2, 2},
                                             {"VEC3", 3, 3},
                                             {"VEC4", 4, 4},
                                             {"MAT2", 4, 2},
                                             {"MAT3", 9, 3},
                                             {"MAT4", 16, 4}}};
  const std::string type = accessor.text("type");
  const auto shape = std::ranges::find_if(kShapes, [&](const Shape& s) { return type == s.name; });
  if (shape == kShapes.end())
    throw accessor.wrong("type", "is '" + one_line(type.substr(0, 40)) + "', which glTF does not define");
  Layout result;
  result.type = accessor.size("componentType", 0);
  result.component = component_bytes(result.type, accessor);
  result.count = accessor.size("count", 0);
  if (result.count > kMaxGltfElements) throw accessor.wrong("count", "is too large");
  result.width = shape->width;
  result.rows = shape->rows;
  const bool matrix = shape->width > shape->rows;
  result.column = matrix ? (shape->rows * result.component + 3) / 4 * 4 : shape->rows * result.component;
  result.element = result.column * (shape->width / shape->rows);
  result.normalized = accessor.flag("normalized");
  return result;
}

std::span<const uint8_t> GltfFile::elements(std::size_t index, std::size_t offset, std::size_t n,
                                            std::size_t stride, std::size_t element_bytes,
                                            const std::string& place) {
  const std::span<const uint8_t> bytes = view(index);
  if (n == 0) return {};
  // n is at most 2^28 and the stride 256 at most, so the product does not overflow.
  const std::size_t length = (n - 1) * stride + element_bytes;
  if (offset > bytes.size() || length > bytes.size() - offset)
    throw FileError(place + ": goes beyond its buffer view");
  return bytes.subspan(offset, length);
}

template <class T>
std::vector<T> GltfFile::read(const GltfValue& accessor, const Layout& form,
                              T (*convert)(const uint8_t*, std::size_t, bool)) {
  if (!accessor.has("bufferView") && form.count * form.width > kMaxGltfZeros)
    throw accessor.wrong("count", "is too large for an accessor without data");
  if (accessor.has("bufferView") && form.count > 0) {  // checked before memory is allocated
    const std::size_t source = *accessor.index("bufferView", count("bufferViews"));
    if (form.count > view(source).size()) throw FileError(accessor.place() + ": goes beyond its buffer view");
  }
  std::vector<T> result(form.count * form.width, T{});
  const auto put = [&](std::size_t target, const uint8_t* element) {
    for (std::size_t k = 0; k < form.width; ++k)
      result[target * form.width + k] = convert(element + form.offset_of(k), form.type, form.normalized);
  };
  if (const std::optional<std::size_t> source = accessor.index("bufferView", count("bufferViews"))) {
    const std::size_t stride = item("bufferViews", *source).size("byteStride", form.element);
    if (stride > kMaxGltfStride || (stride < form.element && form.count > 1))
      throw FileError(accessor.place() + ": the stride of its buffer view must be " +
                      std::to_string(form.element) + " to " + std::to_string(kMaxGltfStride) + " bytes");
    const std::span<const uint8_t> bytes =
        elements(*source, accessor.size("byteOffset", 0), form.count, stride, form.element, accessor.place());
    for (std::size_t i = 0; i < form.count; ++i) put(i, bytes.data() + i * stride);
  }
  const GltfValue sparse = accessor.child("sparse");
  if (!sparse.exists()) return result;
  const GltfValue places = sparse.child("indices"), values = sparse.child("values");
  const std::size_t n = sparse.size("count", 0);
  if (n > form.count) throw sparse.wrong("count", "is larger than the accessor's count");
  const std::optional<std::size_t> place_view = places.index("bufferView", count("bufferViews"));
  const std::optional<std::size_t> value_view = values.index("bufferView", count("bufferViews"));
  if (!place_view || !value_view) throw FileError(sparse.place() + ": has no buffer view");
  const std::size_t type = places.size("componentType", 0), bytes = component_bytes(type, places);
  if (type != kUnsignedByte && type != kUnsignedShort && type != kUnsignedInt)
    throw places.wrong("componentType", "must be an unsigned integer");
  const auto at = elements(*place_view, places.size("byteOffset", 0), n, bytes, bytes, places.place());
  const auto from =
      elements(*value_view, values.size("byteOffset", 0), n, form.element, form.element, values.place());
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t target = gltf_index(at.data() + i * bytes, type, false);
    if (target >= form.count) throw FileError(places.place() + ": has an index beyond the accessor");
    put(target, from.data() + i * form.element);
  }
  return result;
}

GltfNumbers GltfFile::numbers(std::size_t index, int width) {
  const GltfValue accessor = item("accessors", index);
  const Layout form = layout(accessor);
  if (width > 0 && form.width != static_cast<std::size_t>(width))
    throw accessor.wrong(
        "type", "has " + std::to_string(form.width) + " components in place of " + std::to_string(width));
  return {form.count, static_cast<int>(form.width), read<float>(accessor, form, gltf_component)};
}

std::vector<uint32_t> GltfFile::indices(std::size_t index) {
  const GltfValue accessor = item("accessors", index);
  const Layout form = layout(accessor);
  if (form.type != kUnsignedByte && form.type != kUnsignedShort && form.type != kUnsignedInt)
    throw accessor.wrong("componentType", "must be an unsigned integer");
  return read<uint32_t>(accessor, form, gltf_index);
}

}  // namespace offstage::render
