#include "render/frame_files.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/channels.h"
#include "render/file_io.h"
#include "render/image_io.h"

namespace offstage::render {
namespace {

/// Reads parts of a regular file.
class FileParts {
 public:
  explicit FileParts(const std::filesystem::path& path)
      : file_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    struct stat info {};
    if (file_ && ::fstat(file_.fd(), &info) == 0 && S_ISREG(info.st_mode)) size_ = info.st_size;
  }
  off_t size() const { return size_; }
  /// Returns `count` bytes from the position `from`; fewer at the end of the file.
  std::vector<uint8_t> read(off_t from, std::size_t count) const {
    std::vector<uint8_t> bytes(count);
    const ssize_t got = size_ > 0 ? ::pread(file_.fd(), bytes.data(), count, from) : 0;
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }

 private:
  Descriptor file_;
  off_t size_ = 0;
};

int big_endian(const uint8_t* bytes, int count) {
  unsigned value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | bytes[i];
  return static_cast<int>(value);
}

std::optional<FrameFile> inspect_png(const std::filesystem::path& path) {
  const FileParts file(path);
  const std::vector<uint8_t> head = file.read(0, 26), tail = file.read(file.size() - 12, 12);
  constexpr int kPalette = 3;  // an image with a palette, which may have a table of alpha values
  if (head.size() < 26 || tail.size() < 12 || std::memcmp(head.data(), "\x89PNG\r\n\x1a\n", 8) != 0 ||
      std::memcmp(tail.data() + 4, "IEND", 4) != 0)
    return {};
  const int kind = head[25];
  return FrameFile{big_endian(head.data() + 16, 4), big_endian(head.data() + 20, 4),
                   (kind & 4) != 0 || kind == kPalette, png_settings(path)};
}

/// Reads size and settings of a JPEG file from the segments before its pixels. Returns nothing if the file is
/// truncated or is not a JPEG.
std::optional<FrameFile> inspect_jpeg(const std::filesystem::path& path) {
  constexpr int kStartOfImage = 0xD8, kEndOfImage = 0xD9, kStartOfScan = 0xDA, kComment = 0xFE;
  constexpr int kMostSegments = 1000;
  const FileParts file(path);
  const std::vector<uint8_t> start = file.read(0, 2), end = file.read(file.size() - 2, 2);
  if (start != std::vector<uint8_t>{0xFF, kStartOfImage} || end != std::vector<uint8_t>{0xFF, kEndOfImage})
    return {};
  FrameFile result;
  off_t place = 2;
  for (int i = 0; i < kMostSegments; ++i) {
    const std::vector<uint8_t> head = file.read(place, 4);
    if (head.size() < 4 || head[0] != 0xFF) return {};
    const int marker = head[1], length = big_endian(head.data() + 2, 2);
    if (length < 2) return {};
    if (marker == kStartOfScan) break;
    const std::vector<uint8_t> body = file.read(place + 4, static_cast<std::size_t>(length - 2));
    const bool is_frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame && body.size() >= 5) {
      result.height_px = big_endian(body.data() + 1, 2);
      result.width_px = big_endian(body.data() + 3, 2);
    }
    const std::string_view text(reinterpret_cast<const char*>(body.data()), body.size());
    if (marker == kComment && text.starts_with(kJpegSettings))
      result.settings = text.substr(kJpegSettings.size());
    place += 2 + length;
  }
  if (result.width_px == 0) return {};
  return result;
}

class DisplayedSink final : public FrameSink {
 public:
  DisplayedSink(const std::filesystem::path& pattern, const std::string& settings, FrameFormat format)
      : pattern_(pattern), settings_(settings), format_(format) {
    create_parent_folders(frame_path(pattern, 0));
  }
  void write(int frame, const Image& image) override {
    const std::vector<uint8_t> bytes =
        format_ == FrameFormat::jpeg ? encode_jpeg(image, settings_) : encode_png(image, settings_);
    write_file_atomically(frame_path(pattern_, frame), bytes);
  }
  void close() override {}

 private:
  std::filesystem::path pattern_;
  std::string settings_;
  FrameFormat format_;
};

class LinearSink final : public FrameSink {
 public:
  LinearSink(const std::filesystem::path& pattern, const std::string& settings)
      : pattern_(pattern), settings_(settings) {
    create_parent_folders(frame_path(pattern, 0));
  }
  bool needs_linear() const override { return true; }
  void write(int, const Image&) override {}
  void write_linear(int frame, const HdrImage& image) override {
    write_exr(frame_path(pattern_, frame), image, settings_);
  }
  void close() override {}

 private:
  std::filesystem::path pattern_;
  std::string settings_;
};

}  // namespace

std::optional<FrameFormat> frame_format(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  if (ending == ".png") return FrameFormat::png;
  if (ending == ".jpg" || ending == ".jpeg") return FrameFormat::jpeg;
  if (ending == ".exr") return FrameFormat::exr;
  return {};
}

const std::vector<std::string>& frame_endings() {
  static const std::vector<std::string> endings = {".png", ".jpg", ".jpeg", ".exr"};
  return endings;
}

std::optional<FrameFile> inspect_frame(const std::filesystem::path& path) {
  const std::optional<FrameFormat> format = frame_format(path);
  if (!format) return {};
  switch (*format) {
    case FrameFormat::png:
      return inspect_png(path);
    case FrameFormat::jpeg:
      return inspect_jpeg(path);
    case FrameFormat::exr:
      return inspect_exr(path);
  }
  return {};
}

std::filesystem::path frame_path(const std::filesystem::path& pattern, int frame) {
  std::string name = pattern.filename().string();
  const std::size_t last = name.find_last_of('#');
  if (last == std::string::npos) {
    throw std::invalid_argument(pattern.string() + ": has no place for the frame number; write it as '####'");
  }
  const std::size_t before = name.find_last_not_of('#', last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  const std::size_t width = last - first + 1;

  const std::string sign = frame < 0 ? "-" : "";
  std::string digits = std::to_string(frame).substr(sign.size());
  if (digits.size() + sign.size() < width) digits.insert(0, width - digits.size() - sign.size(), '0');
  name.replace(first, width, sign + digits);
  return pattern.parent_path() / name;
}

std::unique_ptr<FrameSink> make_frame_sink(const std::filesystem::path& pattern,
                                           const std::string& settings) {
  const std::optional<FrameFormat> format = frame_format(pattern);
  if (!format) throw std::invalid_argument(pattern.string() + ": is not a name of PNG, JPEG or EXR files");
  if (*format == FrameFormat::exr) return std::make_unique<LinearSink>(pattern, settings);
  return std::make_unique<DisplayedSink>(pattern, settings, *format);
}

}  // namespace offstage::render
