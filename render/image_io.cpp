#include "render/image_io.h"

#include <atomic>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/error.h"
#include "render/file_io.h"
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
#pragma GCC diagnostic pop

namespace offstage::render {
namespace {

constexpr int kMaxSide = 16384;  // OpenGL's limit here too
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

/// A file beside its final place; removed unless it got there.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    static std::atomic<unsigned> counter{0};
    // Named by process and count, not after the target, whose name may be as long as the system allows.
    const std::string name =
        ".offstage-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".part";
    path_ = target.parent_path() / name;
    file_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
    if (!file_) throw_file_error(target_, "cannot be created");
  }
  ~TemporaryFile() {
    if (!renamed_) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::span<const uint8_t> bytes) {
    if (const int error = write_all(file_.fd(), bytes)) throw_file_error(target_, "cannot be written", error);
  }
  void commit() {
    if (::fsync(file_.fd()) != 0) throw_file_error(target_, "cannot be written");
    if (const int error = file_.close()) throw_file_error(target_, "cannot be written", error);
    if (::rename(path_.c_str(), target_.c_str()) != 0) throw_file_error(target_, "cannot be created");
    renamed_ = true;
  }

 private:
  std::filesystem::path target_, path_;
  Descriptor file_;
  bool renamed_ = false;
};

}  // namespace

Image read_image(const std::filesystem::path& path) {
  return decode_image(read_file(path, kMaxImageBytes), path.string());
}

Image decode_image(std::span<const uint8_t> bytes, const std::string& name) {
  const auto fail = [&](const std::string& why) -> FileError {
    return FileError(name + ": cannot be read as an image: " + why);
  };
  if (bytes.empty()) throw fail("it is empty");
  if (bytes.size() > kMaxImageBytes) throw fail("it is larger than 1 GiB");
  const int size = static_cast<int>(bytes.size());
  int width = 0, height = 0, channels = 0;
  if (!stbi_info_from_memory(bytes.data(), size, &width, &height, &channels))
    throw fail(stbi_failure_reason());
  if (width > kMaxSide || height > kMaxSide) {
    throw fail("it has " + std::to_string(width) + "x" + std::to_string(height) + " pixels, of at most " +
               std::to_string(kMaxSide) + " a side");
  }
  if (bytes[0] == 'P' && stbi_is_16_bit_from_memory(bytes.data(), size)) {
    throw fail("PNM of 16 bits is not supported; convert it to PNG");  // stb_image swaps its bytes
  }
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(bytes.data(), size, &width, &height, &channels, STBI_rgb_alpha), stbi_image_free);
  if (!pixels) throw fail(stbi_failure_reason());
  Image image{width, height, {}};
  image.rgba.assign(pixels.get(), pixels.get() + image.pixel_count() * 4);
  image.transparent = channels == 2 || channels == 4;
  return image;
}

std::vector<uint8_t> encode_png(const Image& image) {
  const std::vector<uint8_t> rgb = image.transparent ? std::vector<uint8_t>{} : without_alpha(image);
  return encode_png(PngPixels{.width_px = image.width_px,
                              .height_px = image.height_px,
                              .channels = image.transparent ? 4 : 3,
                              .samples = image.transparent ? image.rgba : rgb});
}

void write_file_atomically(const std::filesystem::path& path, std::span<const uint8_t> bytes) {
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode)) {
    // A device or a pipe is written to; renaming would replace it.
    Descriptor device(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (!device) throw_file_error(path, "cannot be opened");
    if (const int error = write_all(device.fd(), bytes)) throw_file_error(path, "cannot be written", error);
    return;
  }
  TemporaryFile file(path);
  file.write(bytes);
  file.commit();
}

void write_png(const std::filesystem::path& path, const Image& image) {
  write_file_atomically(path, encode_png(image));
}

}  // namespace offstage::render
