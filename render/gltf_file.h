#pragma once
/// Private: the container of a glTF 2.0 model (.gltf or .glb): its document, its buffers, and accessors as
/// numbers. All sizes and offsets are checked against the size of the data.
/// Section numbers refer to the glTF 2.0 specification (Khronos Group, 2021).

#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "render/gltf_json.h"
#include "render/input_folders.h"

namespace offstage::render {

/// The converted data of an accessor: `count` elements of `width` numbers. Normalised integers are scaled to
/// [0, 1] or
/// [-1, 1] (section 3.11).
struct GltfNumbers {
  std::size_t count = 0;
  int width = 0;  ///< numbers per element: 1 to 4, or 4, 9, 16 for matrices by columns
  std::vector<float> values;

  const float* at(std::size_t i) const { return values.data() + i * static_cast<std::size_t>(width); }
};

class GltfFile {
 public:
  /// Reads the document. Throws FileError for a broken file.
  GltfFile(std::filesystem::path path, const InputFolders& folders);
  bool is_version_1() const;
  /// Throws FileError for an unknown version, and for an extension that is required and not supported.
  void check();

  const GltfValue& root() const { return root_; }
  std::size_t count(const char* list) const { return root_.count(list); }
  GltfValue item(const char* list, std::size_t i) const { return root_.item(list, i); }
  const std::filesystem::path& path() const { return path_; }

  /// Returns the bytes of a buffer view, decompressed if needed.
  std::span<const uint8_t> view(std::size_t index);
  /// Returns the bytes of a data: URI, or of the file beside the model that a URI names. `what` is used in
  /// messages.
  std::vector<uint8_t> resource(const std::string& uri, const std::string& what) const;

  /// Reads an accessor of any component type, with sparse values (section 3.6.2). `width`: the number of
  /// components that its use allows, 0: any.
  GltfNumbers numbers(std::size_t accessor, int width = 0);
  /// Reads an accessor of unsigned integers with one component (indices).
  std::vector<uint32_t> indices(std::size_t accessor);

  /// Records a warning, once per text.
  void warn(const std::string& line);
  std::vector<std::string> take_warnings() { return std::move(warnings_); }

 private:
  struct Layout;
  void load(std::vector<uint8_t> bytes);
  void check_extensions();
  const std::vector<uint8_t>& buffer(std::size_t index);
  std::span<const uint8_t> range(std::size_t buffer, std::size_t offset, std::size_t length,
                                 const std::string& place);
  std::vector<uint8_t> unpack(const GltfValue& compressed);
  Layout layout(const GltfValue& accessor) const;
  std::span<const uint8_t> elements(std::size_t view, std::size_t offset, std::size_t count,
                                    std::size_t stride, std::size_t element_bytes, const std::string& place);
  template <class T>
  std::vector<T> read(const GltfValue& accessor, const Layout& form,
                      T (*convert)(const uint8_t*, std::size_t, bool));

  std::filesystem::path path_;
  const InputFolders& folders_;
  GltfValue::Json document_;
  GltfValue root_{nullptr, ""};
  std::vector<uint8_t> binary_;  ///< BIN chunk of a .glb
  bool has_binary_ = false;
  std::map<std::size_t, std::vector<uint8_t>> buffers_, unpacked_;
  std::vector<std::string> warnings_;
  std::set<std::string> warned_;
};

/// Returns whether a file is glTF by its name.
bool is_gltf(const std::filesystem::path& path);

}  // namespace offstage::render
