#include "render/video_frames.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/file_io.h"

namespace offstage::render {
namespace {

/// Contents of a container file. `whole`: whether its parts fill the file and the last part exists.
struct Contents {
  bool whole = false;
  uint64_t frames = 0;
  std::optional<double> seconds;  // duration, for formats that merge equal frames
};

/// Reads numbers at any position of a file; beyond its end they are 0.
class FileView {
 public:
  explicit FileView(const std::filesystem::path& path)
      : file_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    struct stat info {};
    if (!file_ || ::fstat(file_.fd(), &info) != 0) throw_file_error(path, "cannot be read");
    size_ = static_cast<uint64_t>(std::max<off_t>(info.st_size, 0));
  }

  uint64_t size() const { return size_; }
  uint64_t big(uint64_t at, int bytes) { return number(at, bytes, true); }
  uint64_t little(uint64_t at, int bytes) { return number(at, bytes, false); }
  uint8_t byte(uint64_t at) {
    if (at < start_ || at >= start_ + length_) fill(at);
    return at >= start_ && at < start_ + length_ ? buffer_[at - start_] : uint8_t{0};
  }
  bool is(uint64_t at, std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i)
      if (byte(at + i) != static_cast<uint8_t>(text[i])) return false;
    return at + text.size() <= size_;
  }

 private:
  void fill(uint64_t at) {
    start_ = at;
    const ssize_t got = ::pread(file_.fd(), buffer_.data(), buffer_.size(), static_cast<off_t>(at));
    length_ = got > 0 ? static_cast<std::size_t>(got) : 0;
  }
  uint64_t number(uint64_t at, int bytes, bool big_end_first) {
    uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) {
      const uint64_t next = byte(at + static_cast<uint64_t>(i));
      value = big_end_first ? value << 8 | next : value | next << (8 * i);
    }
    return value;
  }

  Descriptor file_;
  uint64_t size_ = 0, start_ = 0;
  std::size_t length_ = 0;
  std::array<uint8_t, 4096> buffer_{};
};

/// MP4 and QuickTime (ISO/IEC 14496-12): visits the boxes between two positions of the file. The number of
/// frames is in the box moov/trak/mdia/minf/stbl/stsz.
void visit_boxes(FileView& file, uint64_t at, uint64_t end, Contents& found, bool& index) {
  while (at + 8 <= end) {
    uint64_t length = file.big(at, 4), head = 8;
    if (length == 1) {
      length = file.big(at + 8, 8);
      head = 16;
    }
    if (length < head || length > end - at) return;
    index |= file.is(at + 4, "moov");
    for (const std::string_view name : {"moov", "trak", "mdia", "minf", "stbl"})
      if (file.is(at + 4, name)) visit_boxes(file, at + head, at + length, found, index);
    if (file.is(at + 4, "stsz")) found.frames += file.big(at + head + 8, 4);
    at += length;
  }
  found.whole = index && at == end;
}

Contents read_boxes(FileView& file) {
  Contents found;
  bool index = false;
  visit_boxes(file, 0, file.size(), found, index);
  return found;
}

/// Matroska and WebM (RFC 8794, RFC 9559): blocks in the clusters of the segment, which must fill the file.
class Matroska {
 public:
  explicit Matroska(FileView& file) : file_(file) {}

  Contents read() {
    found_.whole = visit(0, file_.size());
    return found_;
  }

 private:
  static constexpr uint64_t kSegment = 0x18538067, kCluster = 0x1F43B675, kBlockGroup = 0xA0, kBlock = 0xA1,
                            kSimpleBlock = 0xA3;

  /// Reads a number of variable size. `keep_marker`: keep the marker bit, as ids do. Returns nothing if the
  /// number means an unknown size.
  std::optional<uint64_t> number(uint64_t& at, bool keep_marker) {
    const uint8_t first = file_.byte(at);
    int length = 1;
    while (length <= 8 && (first & (0x80 >> (length - 1))) == 0) ++length;
    if (length > 8) return {};
    uint64_t value = file_.big(at, length);
    at += static_cast<uint64_t>(length);
    if (keep_marker) return value;
    const uint64_t most = (uint64_t{1} << (7 * length)) - 1;
    value &= most;
    return value == most ? std::nullopt : std::optional(value);
  }

  bool visit(uint64_t at, uint64_t end) {
    while (at < end) {
      const auto id = number(at, true), size = number(at, false);
      if (!id || !size || *size > end - at) return false;
      if (*id == kBlock || *id == kSimpleBlock) ++found_.frames;
      const bool opens = *id == kSegment || *id == kCluster || *id == kBlockGroup;
      if (opens && !visit(at, at + *size)) return false;
      at += *size;
    }
    return at == end;
  }

  FileView& file_;
  Contents found_;
};

/// Reads a GIF89a file up to its trailer. The graphic control extensions contain the duration of each frame,
/// in hundredths of a second.
Contents read_gif(FileView& file) {
  Contents found{.seconds = 0};
  if (!file.is(0, "GIF8")) return found;
  const auto table = [](uint8_t flags) { return (flags & 0x80) != 0 ? 3u << ((flags & 7) + 1) : 0u; };
  uint64_t at = 13 + table(file.byte(10));
  const auto skip_blocks = [&] {
    while (at < file.size() && file.byte(at) != 0) at += file.byte(at) + 1u;
    ++at;
  };
  while (at < file.size()) {
    const uint8_t kind = file.byte(at);
    if (kind == 0x3B) {
      found.whole = at + 1 == file.size();
      return found;
    }
    if (kind == 0x21) {
      if (file.byte(at + 1) == 0xF9) *found.seconds += static_cast<double>(file.little(at + 4, 2)) / 100;
      at += 2;
    } else if (kind == 0x2C) {
      ++found.frames;
      at += 11 + table(file.byte(at + 9));  // the length includes the byte with the code size of the pixels
    } else {
      return found;
    }
    skip_blocks();
  }
  return found;
}

/// Reads a WebP file (RFC 9649), a RIFF file whose chunks must fill it completely. Each ANMF chunk is a
/// frame, with its duration in milliseconds.
Contents read_webp(FileView& file) {
  Contents found{.seconds = 0};
  if (!file.is(0, "RIFF") || !file.is(8, "WEBP") || file.little(4, 4) + 8 != file.size()) return found;
  uint64_t at = 12;
  while (at + 8 <= file.size()) {
    const uint64_t length = file.little(at + 4, 4);
    if (file.is(at, "ANMF")) {
      ++found.frames;
      *found.seconds += static_cast<double>(file.little(at + 8 + 12, 3)) / 1000;
    }
    if (file.is(at, "VP8 ") || file.is(at, "VP8L")) found.seconds.reset();  // a still picture
    if (length > file.size() - at - 8) return found;
    at += 8 + length + length % 2;
  }
  found.whole = at == file.size();
  if (!found.seconds) found.frames = 1;
  return found;
}

/// Reads an animated PNG up to its IEND chunk. It has a frame control chunk for every frame. A film of one
/// frame is a plain PNG.
Contents read_apng(FileView& file) {
  Contents found;
  if (!file.is(0, "\x89PNG\r\n\x1a\n")) return found;
  uint64_t at = 8;
  bool animated = false;
  while (at + 12 <= file.size()) {
    const uint64_t length = file.big(at, 4);
    if (length > file.size() - at - 12) return found;
    found.frames += file.is(at + 4, "fcTL");
    animated = animated || file.is(at + 4, "acTL");
    const bool last = file.is(at + 4, "IEND");
    at += 12 + length;
    if (last) found.whole = at == file.size();
  }
  if (!animated) found.frames = 1;
  return found;
}

Contents contents_of(FileView& file, const std::string& ending) {
  if (ending == ".mp4" || ending == ".mov") return read_boxes(file);
  if (ending == ".webm" || ending == ".mkv") return Matroska(file).read();
  if (ending == ".gif") return read_gif(file);
  if (ending == ".webp") return read_webp(file);
  return read_apng(file);
}

}  // namespace

std::string wrong_with_video(const std::filesystem::path& path, const std::filesystem::path& name, int frames,
                             double seconds) {
  FileView file(path);
  std::string ending = name.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const Contents found = contents_of(file, ending);
  if (!found.whole) return "its last part is missing";
  const auto expected = static_cast<uint64_t>(frames);
  if (!found.seconds) {
    if (found.frames == expected) return {};
    return "it has " + std::to_string(found.frames) + " of " + std::to_string(frames) + " frames";
  }
  // Time stamps are rounded, and the duration of the last frame may differ from the intended one.
  const double frame_s = seconds / frames, rounding_s = 0.011;
  if (found.frames > 0 && found.frames <= expected && *found.seconds > seconds - 1.5 * frame_s - rounding_s)
    return {};
  return "it lasts " + std::to_string(*found.seconds) + " of " + std::to_string(seconds) + " s";
}

}  // namespace offstage::render
