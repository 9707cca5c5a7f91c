#include "render/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/error.h"
#include "render/exr.h"
#include "render/file_io.h"
#include "render/gltf_packed.h"
#include "render/output_file.h"
#include "render/png.h"
#include "render/tone_map.h"

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_FAILURE_USERMSG
#define STBI_NO_STDIO
#define STBI_NO_PIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb_image.h>
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace offstage::render {
namespace {

constexpr int kMaxSide = 16384;  // also the limit of OpenGL with llvmpipe
constexpr uint64_t kMaxImageBytes = uint64_t{1} << 30;

FileError unreadable_image(const std::string& name, const std::string& why) {
  return FileError(name + ": cannot be read as an image: " + why);
}

/// Checks the size that the file declares, before anything is decoded.
void check_image_size(int width, int height, const std::string& name, uint64_t max_pixels) {
  const std::string size =
      "it has " + std::to_string(width) + "x" + std::to_string(height) + " pixels; at most ";
  if (width > kMaxSide || height > kMaxSide)
    throw unreadable_image(name, size + std::to_string(kMaxSide) + " per side are possible");
  if (static_cast<uint64_t>(width) * static_cast<uint64_t>(height) > max_pixels)
    throw unreadable_image(name, size + std::to_string(max_pixels >> 20) + " Mi pixels are possible");
}

/// Returns the size in the header of a PNG file, or nothing for other files. stb_image calls a PNG file that
/// is too large for it an unknown type.
std::optional<std::array<uint32_t, 2>> png_size(std::span<const uint8_t> bytes) {
  constexpr std::array<uint8_t, 8> kSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::size_t kSizeAt = 16;  // after the signature, and the length and name of the first chunk
  if (bytes.size() < kSizeAt + 8 || !std::ranges::equal(bytes.first(kSignature.size()), kSignature))
    return {};
  std::array<uint32_t, 2> size{};
  for (std::size_t i = 0; i < 8; ++i) size[i / 4] = size[i / 4] << 8 | bytes[kSizeAt + i];
  return size;
}

void check_declared_size(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels) {
  constexpr uint32_t kMostOfFormat = std::numeric_limits<int>::max();
  if (const auto size = png_size(bytes); size && std::max((*size)[0], (*size)[1]) <= kMostOfFormat)
    check_image_size(static_cast<int>((*size)[0]), static_cast<int>((*size)[1]), name, max_pixels);
  int width = 0, height = 0, channels = 0;
  if (!stbi_info_from_memory(bytes.data(), static_cast<int>(bytes.size()), &width, &height, &channels))
    throw unreadable_image(name, stbi_failure_reason());
  check_image_size(width, height, name, max_pixels);
}

template <class T>
using StbPixels = std::unique_ptr<T, void (*)(void*)>;

/// For a truncated file, stb_image silently reads zeros beyond the end of its input and returns black or grey
/// rows. Therefore it gets a copy with additional zeros at the end, and a file is refused if stb_image has
/// read these zeros. `load(context)` calls its function for pixels of type T.
template <class T, class Load>
StbPixels<T> decode_whole(std::span<const uint8_t> bytes, const std::string& name, Load load) {
  int width = 0, height = 0, channels = 0;
  stbi_info_from_memory(bytes.data(), static_cast<int>(bytes.size()), &width, &height, &channels);
  // The number of additional zeros is more than a decoder reads at once: a few rows, or all pixels of a PNM
  // file.
  const std::size_t rows = bytes[0] == 'P' ? static_cast<std::size_t>(height) : 4;
  std::vector<uint8_t> padded(bytes.size() + 4 * static_cast<std::size_t>(width) * rows + 65536);
  std::ranges::copy(bytes, padded.begin());
  stbi__context context;
  stbi__start_mem(&context, padded.data(), static_cast<int>(padded.size()));
  StbPixels<T> pixels(static_cast<T*>(load(&context)), stbi_image_free);
  if (context.img_buffer > padded.data() + bytes.size()) throw unreadable_image(name, "it is cut short");
  if (!pixels) throw unreadable_image(name, stbi_failure_reason());
  return pixels;
}

bool is_exr(std::span<const uint8_t> bytes) {
  constexpr uint8_t kMagic[] = {0x76, 0x2F, 0x31, 0x01};
  return bytes.size() > 4 && std::memcmp(bytes.data(), kMagic, 4) == 0;
}

/// Calls value(i) for the three colours of all pixels; i counts samples of RGBA.
HdrImage filled_light(int width, int height, const auto& value) {
  HdrImage image{width, height, {}};
  image.rgba.resize(image.pixel_count() * 4);
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = i % 4 == 3 ? 1.0f : value(i);
  return image;
}

HdrImage decode_light(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels) {
  const int size = static_cast<int>(bytes.size());
  if (is_exr(bytes)) return decode_exr(bytes, name, max_pixels);
  int width = 0, height = 0, channels = 0;
  if (!is_webp(bytes) && stbi_is_hdr_from_memory(bytes.data(), size)) {
    check_declared_size(bytes, name, max_pixels);
    const auto pixels = decode_whole<float>(bytes, name, [&](stbi__context* file) {
      return stbi__loadf_main(file, &width, &height, &channels, STBI_rgb_alpha);
    });
    return filled_light(width, height, [&](std::size_t i) { return pixels.get()[i]; });
  }
  if (!is_webp(bytes) && bytes[0] != 'P' && stbi_is_16_bit_from_memory(bytes.data(), size)) {
    check_declared_size(bytes, name, max_pixels);
    const auto pixels = decode_whole<stbi_us>(bytes, name, [&](stbi__context* file) {
      return stbi__load_and_postprocess_16bit(file, &width, &height, &channels, STBI_rgb_alpha);
    });
    return filled_light(width, height, [&](std::size_t i) {
      return srgb_decode(static_cast<float>(pixels.get()[i]) / 65535);
    });
  }
  const Image image = decode_image(bytes, name, max_pixels);
  return filled_light(image.width_px, image.height_px,
                      [&](std::size_t i) { return srgb_decode(static_cast<float>(image.rgba[i]) / 255); });
}

std::vector<uint8_t> without_alpha(const Image& image) {
  std::vector<uint8_t> rgb(image.rgba.size() / 4 * 3);
  const uint8_t* in = image.rgba.data();
  for (uint8_t *out = rgb.data(), *end = out + rgb.size(); out != end; out += 3, in += 4) {
    out[0] = in[0];
    out[1] = in[1];
    out[2] = in[2];
  }
  return rgb;
}

}  // namespace

Image read_image(const std::filesystem::path& path, uint64_t max_pixels) {
  return decode_image(read_file(path, kMaxImageBytes), path.string(), max_pixels);
}

Image decode_image(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels) {
  const auto fail = [&](const std::string& why) { return unreadable_image(name, why); };
  if (bytes.empty()) throw fail("it is empty");
  if (bytes.size() > kMaxImageBytes) throw fail("it is larger than 1 GiB");
  if (is_webp(bytes)) return decode_webp(bytes, name, max_pixels);
  const int size = static_cast<int>(bytes.size());
  if (is_exr(bytes) || stbi_is_hdr_from_memory(bytes.data(), size))
    throw fail("HDR and EXR files are supported only for environment.picture; convert the file to PNG");
  int width = 0, height = 0, channels = 0;
  check_declared_size(bytes, name, max_pixels);
  if (bytes[0] == 'P' && stbi_is_16_bit_from_memory(bytes.data(), size)) {
    throw fail("PNM with 16 bits is not supported; convert the file to PNG");  // stb_image swaps the bytes of
                                                                               // their samples
  }
  const auto pixels = decode_whole<stbi_uc>(bytes, name, [&](stbi__context* file) {
    return stbi__load_and_postprocess_8bit(file, &width, &height, &channels, STBI_rgb_alpha);
  });
  Image image{width, height, {}};
  image.rgba.assign(pixels.get(), pixels.get() + image.pixel_count() * 4);
  image.transparent = channels == 2 || channels == 4;
  return image;
}

LightImage decode_light_image(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels) {
  if (bytes.empty()) throw unreadable_image(name, "it is empty");
  if (bytes.size() > kMaxImageBytes) throw unreadable_image(name, "it is larger than 1 GiB");
  constexpr float kLargest = 65504;  // the largest half float
  LightImage result{decode_light(bytes, name, max_pixels), {}};
  std::size_t raised = 0, limited = 0;
  for (float& value : result.image.rgba) {
    if (!(value >= 0)) ++raised;
    if (std::isinf(value) && value > 0) ++limited;
    value = !(value >= 0) ? 0.0f : std::isinf(value) ? kLargest : value;
  }
  if (raised > 0)
    result.warnings.push_back(std::to_string(raised) + " values are negative or not numbers; 0 was used");
  if (limited > 0)
    result.warnings.push_back(std::to_string(limited) + " values are infinite; 65504 was used");
  return result;
}

std::vector<uint8_t> encode_png(const Image& image, const std::string& settings) {
  const std::vector<uint8_t> rgb = image.transparent ? std::vector<uint8_t>{} : without_alpha(image);
  return encode_png(PngPixels{.width_px = image.width_px,
                              .height_px = image.height_px,
                              .channels = image.transparent ? 4 : 3,
                              .samples = image.transparent ? image.rgba : rgb,
                              .settings = settings});
}

std::vector<uint8_t> encode_jpeg(const Image& image, const std::string& settings) {
  constexpr int kQuality = 95;
  std::vector<uint8_t> bytes;
  const auto append = [](void* context, void* data, int size) {
    const auto* first = static_cast<const uint8_t*>(data);
    static_cast<std::vector<uint8_t>*>(context)->insert(static_cast<std::vector<uint8_t>*>(context)->end(),
                                                        first, first + size);
  };
  if (!stbi_write_jpg_to_func(append, &bytes, image.width_px, image.height_px, 3, without_alpha(image).data(),
                              kQuality))
    throw std::invalid_argument("a picture of " + std::to_string(image.width_px) + "x" +
                                std::to_string(image.height_px) + " pixels cannot be a JPEG");
  if (settings.empty()) return bytes;
  // The comment follows the first segment, which must be JFIF's.
  const std::string text = std::string(kJpegSettings) + settings;
  const std::size_t length = text.size() + 2;
  std::vector<uint8_t> comment = {0xFF, 0xFE, static_cast<uint8_t>(length >> 8),
                                  static_cast<uint8_t>(length)};
  comment.insert(comment.end(), text.begin(), text.end());
  constexpr std::ptrdiff_t kJfifEnd = 20;
  bytes.insert(bytes.begin() + kJfifEnd, comment.begin(), comment.end());
  return bytes;
}

std::string png_settings(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  std::vector<uint8_t> head(kPngHeadBytes);
  const ssize_t size = ::pread(file.fd(), head.data(), head.size(), 0);
  head.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return settings_in_png(head);
}

void write_file_atomically(const std::filesystem::path& path, std::span<const uint8_t> bytes) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) == 0 && (S_ISFIFO(info.st_mode) || S_ISCHR(info.st_mode))) {
    // A pipe or a device is written to directly, because renaming would replace it. A pipe without a reader
    // is refused.
    Descriptor device(::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC));
    if (!device) throw_file_error(path, "cannot be opened");
    if (const int error = write_all(device.fd(), bytes)) throw_file_error(path, "cannot be written", error);
    return;
  }
  OutputFile file(path);
  file.write(bytes);
  file.commit();
}

void write_png(const std::filesystem::path& path, const Image& image, const std::string& settings) {
  write_file_atomically(path, encode_png(image, settings));
}

}  // namespace offstage::render
