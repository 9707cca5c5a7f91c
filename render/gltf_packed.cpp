#include "render/gltf_packed.h"

#include <cstring>

#include "render/error.h"
#include "render/file_io.h"

#ifdef OFFSTAGE_DRACO
#include <draco/compression/decode.h>
#endif
#ifdef OFFSTAGE_MESHOPT
#include <meshoptimizer.h>
#endif
#ifdef OFFSTAGE_WEBP
#include <webp/decode.h>
#endif

namespace offstage::render {

#ifdef OFFSTAGE_MESHOPT
bool has_meshopt() {
  return true;
}

std::vector<uint8_t> unpack_meshopt(const MeshoptView& view, std::span<const uint8_t> packed) {
  const std::size_t n = view.count, stride = view.stride;
  const auto check = [&](bool good, const char* why) {
    if (!good) throw FileError(view.place + ": " + why);
  };
  std::vector<uint8_t> result(n * stride);
  int error = 0;
  if (view.mode == "ATTRIBUTES") {
    check(stride > 0 && stride <= 256 && stride % 4 == 0, "its stride must be a multiple of 4 up to 256");
    error = meshopt_decodeVertexBuffer(result.data(), n, stride, packed.data(), packed.size());
  } else if (view.mode == "TRIANGLES") {
    check((stride == 2 || stride == 4) && n % 3 == 0, "has no whole triangles of 2 or 4 bytes per index");
    error = meshopt_decodeIndexBuffer(result.data(), n, stride, packed.data(), packed.size());
  } else if (view.mode == "INDICES") {
    check(stride == 2 || stride == 4, "its indices must have 2 or 4 bytes");
    error = meshopt_decodeIndexSequence(result.data(), n, stride, packed.data(), packed.size());
  } else {
    check(false, "its mode is unknown");
  }
  check(error == 0, "its compressed data is damaged");
  if (view.filter == "OCTAHEDRAL") {
    check(stride == 4 || stride == 8, "its filter needs a stride of 4 or 8");
    meshopt_decodeFilterOct(result.data(), n, stride);
  } else if (view.filter == "QUATERNION") {
    check(stride == 8, "its filter needs a stride of 8");
    meshopt_decodeFilterQuat(result.data(), n, stride);
  } else if (view.filter == "EXPONENTIAL") {
    check(stride % 4 == 0, "its filter needs a stride that is a multiple of 4");
    meshopt_decodeFilterExp(result.data(), n, stride);
  } else {
    check(view.filter == "NONE", "its filter is unknown");
  }
  return result;
}
#else
bool has_meshopt() {
  return false;
}
std::vector<uint8_t> unpack_meshopt(const MeshoptView& view, std::span<const uint8_t>) {
  throw FileError(view.place +
                  ": cannot be unpacked: this program was built without meshoptimizer; install "
                  "libmeshoptimizer-dev and build it again");
}
#endif

#ifdef OFFSTAGE_DRACO
bool has_draco() {
  return true;
}

DracoMesh unpack_draco(std::span<const uint8_t> packed, const std::map<std::string, uint32_t>& ids,
                       const std::string& place) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(packed.data()), packed.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok())
    throw FileError(place + ": its Draco data is damaged: " + one_line(decoded.status().error_msg_string()));
  const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  DracoMesh result;
  result.indices.reserve(std::size_t{mesh->num_faces()} * 3);
  for (uint32_t f = 0; f < mesh->num_faces(); ++f)
    for (const draco::PointIndex& corner : mesh->face(draco::FaceIndex(f)))
      result.indices.push_back(corner.value());
  for (const auto& [name, id] : ids) {
    const draco::PointAttribute* attribute = mesh->GetAttributeByUniqueId(id);
    if (attribute == nullptr) throw FileError(place + ": its Draco data lacks " + name);
    const int width = attribute->num_components();
    if (width < 1 || width > 4)
      throw FileError(place + ": " + name + " has " + std::to_string(width) + " components");
    DracoMesh::Attribute& out = result.attributes[name];
    out.width = width;
    out.normalized = attribute->normalized();
    out.values.resize(std::size_t{mesh->num_points()} * static_cast<std::size_t>(width));
    for (uint32_t i = 0; i < mesh->num_points(); ++i) {
      const draco::AttributeValueIndex value = attribute->mapped_index(draco::PointIndex(i));
      if (value.value() >= attribute->size() ||
          !attribute->ConvertValue<float>(
              value, static_cast<int8_t>(width),
              out.values.data() + std::size_t{i} * static_cast<std::size_t>(width)))
        throw FileError(place + ": its Draco data is damaged");
    }
  }
  return result;
}
#else
bool has_draco() {
  return false;
}
DracoMesh unpack_draco(std::span<const uint8_t>, const std::map<std::string, uint32_t>&,
                       const std::string& place) {
  throw FileError(
      place +
      ": cannot be unpacked: this program was built without Draco; install libdraco-dev and build it again");
}
#endif

bool is_webp(std::span<const uint8_t> bytes) {
  return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
         std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

#ifdef OFFSTAGE_WEBP
bool has_webp() {
  return true;
}

Image decode_webp(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels) {
  constexpr const char* kBroken = ": cannot be read as an image: its WebP data is damaged";
  WebPBitstreamFeatures features{};
  if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK)
    throw FileError(name + kBroken);
  if (features.has_animation) throw FileError(name + ": cannot be read as an image: it is an animation");
  const auto width = static_cast<uint64_t>(features.width), height = static_cast<uint64_t>(features.height);
  if (width * height > max_pixels)
    throw FileError(name + ": cannot be read as an image: it has " + std::to_string(width) + "x" +
                    std::to_string(height) + " pixels; at most " + std::to_string(max_pixels >> 20) +
                    " Mi pixels are possible");
  Image image{features.width, features.height, std::vector<uint8_t>(width * height * 4)};
  image.transparent = features.has_alpha != 0;
  if (WebPDecodeRGBAInto(bytes.data(), bytes.size(), image.rgba.data(), image.rgba.size(),
                         features.width * 4) == nullptr)
    throw FileError(name + kBroken);
  return image;
}
#else
bool has_webp() {
  return false;
}
Image decode_webp(std::span<const uint8_t>, const std::string& name, uint64_t) {
  throw FileError(name +
                  ": is a WebP image, and this program was built without libwebp; install libwebp-dev and "
                  "build it again");
}
#endif

}  // namespace offstage::render
