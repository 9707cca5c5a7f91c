#pragma once
/// Private: decompresses parts of glTF files with the libraries Draco, meshoptimizer and WebP. Each library
/// is optional when offstage is built. Without it, its function throws a FileError that names the library.

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "render/image.h"

namespace offstage::render {

bool has_draco();
bool has_meshopt();
bool has_webp();

/// One buffer view of EXT_meshopt_compression.
struct MeshoptView {
  std::string mode;    ///< ATTRIBUTES, TRIANGLES or INDICES
  std::string filter;  ///< NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL
  std::size_t count = 0, stride = 0;
  std::string place;  ///< place in the document, for messages
};
/// Returns `count * stride` bytes. Throws FileError.
std::vector<uint8_t> unpack_meshopt(const MeshoptView& view, std::span<const uint8_t> packed);

/// A mesh of KHR_draco_mesh_compression.
struct DracoMesh {
  struct Attribute {
    int width = 0;            ///< numbers per vertex
    bool normalized = false;  ///< whether integers were scaled to [0, 1] or [-1, 1]
    std::vector<float> values;
  };
  std::vector<uint32_t> indices;
  std::map<std::string, Attribute> attributes;
};
/// Decodes the attributes with the given ids in the Draco data. Throws FileError.
DracoMesh unpack_draco(std::span<const uint8_t> packed, const std::map<std::string, uint32_t>& ids,
                       const std::string& place);

/// Returns whether the bytes are a WebP image.
bool is_webp(std::span<const uint8_t> bytes);
/// Decodes a WebP image of up to `max_pixels`. Throws FileError.
Image decode_webp(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels);

}  // namespace offstage::render
