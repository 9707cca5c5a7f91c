#include "render/image_io.h"

#include <cstdlib>
#include <memory>
#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/error.h"
#include "render/file_io.h"
#include "render/gltf_packed.h"
#include "render/output_file.h"
#include "render/png.h"

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_FAILURE_USERMSG
#define STBI_NO_STDIO
#define STBI_NO_HDR
#define STBI_NO_LINEAR
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

constexpr int kMaxSide = 16384;  // also OpenGL's limit here
constexpr uint64_t kMaxImageBytes = uint64_t{1} << 30;

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
  const auto fail = [&](const std::string& why) -> FileError {
    return FileError(name + ": cannot be read as an image: " + why);
  };
  if (bytes.empty()) throw fail("it is empty");
  if (bytes.size() > kMaxImageBytes) throw fail("it is larger than 1 GiB");
  if (is_webp(bytes)) return decode_webp(bytes, name, max_pixels);
  const int size = static_cast<int>(bytes.size());
  int width = 0, height = 0, channels = 0;
  if (!stbi_info_from_memory(bytes.data(), size, &width, &height, &channels))
    throw fail(stbi_failure_reason());
  if (width > kMaxSide || height > kMaxSide) {
    throw fail("it has " + std::to_string(width) + "x" + std::to_string(height) + " pixels, of at most " +
               std::to_string(kMaxSide) + " a side");
  }
  if (static_cast<uint64_t>(width) * static_cast<uint64_t>(height) > max_pixels) {
    throw fail("it has " + std::to_string(width) + "x" + std::to_string(height) + " pixels, of at most " +
               std::to_string(max_pixels >> 20) + " Mi");
  }
  if (bytes[0] == 'P' && stbi_is_16_bit_from_memory(bytes.data(), size)) {
    throw fail("PNM of 16 bits is not supported; convert it to PNG");  // stb_image swaps their bytes
  }
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(bytes.data(), size, &width, &height, &channels, STBI_rgb_alpha), stbi_image_free);
  if (!pixels) throw fail(stbi_failure_reason());
  Image image{width, height, {}};
  image.rgba.assign(pixels.get(), pixels.get() + image.pixel_count() * 4);
  image.transparent = channels == 2 || channels == 4;
  return image;
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
