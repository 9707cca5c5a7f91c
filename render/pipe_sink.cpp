#include <array>
#include <cerrno>
#include <stdexcept>

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/error.h"
#include "render/file_io.h"
#include "render/sink.h"

namespace offstage::render {
namespace {

/// Blocks SIGPIPE on this thread, so that a closed pipe is reported as an error number, and removes the
/// pending signal.
class SigpipeBlock {
 public:
  SigpipeBlock() {
    sigemptyset(&sigpipe_);
    sigaddset(&sigpipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &sigpipe_, &before_);
  }
  ~SigpipeBlock() {
    const timespec now{};
    while (!was_pending_ && sigtimedwait(&sigpipe_, nullptr, &now) < 0 && errno == EINTR) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  SigpipeBlock(const SigpipeBlock&) = delete;
  SigpipeBlock& operator=(const SigpipeBlock&) = delete;

 private:
  sigset_t sigpipe_{}, before_{};
  bool was_pending_ = false;
};

/// Standard output. A pipe is opened a second time. The new descriptor is non-blocking for this process,
/// while the pipe stays blocking for other processes that share it.
class StandardOutput {
 public:
  explicit StandardOutput(StopTest stop) : stop_(std::move(stop)) {
    struct stat info {};
    if (::fstat(STDOUT_FILENO, &info) == 0 && S_ISFIFO(info.st_mode))
      own_ = Descriptor(::open("/proc/self/fd/1", O_WRONLY | O_NONBLOCK | O_CLOEXEC));
  }

  void write(std::span<const uint8_t> bytes) {
    const SigpipeBlock block;
    const int error = write_all(own_ ? own_.fd() : STDOUT_FILENO, bytes, stop_);
    if (error == EPIPE) throw FileError("standard output: the program that reads the frames has ended");
    if (error == ECANCELED) throw StoppedError("standard output: no program reads the frames");
    if (error != 0) throw_file_error("standard output", "cannot be written", error);
  }

 private:
  StopTest stop_;
  Descriptor own_;
};

/// Converts a colour to BT.709 luma and colour differences of limited range. The computation is in 16-bit
/// fixed point and rounded.
std::array<uint8_t, 3> yuv_from_rgb(const uint8_t* rgb) {
  const int r = rgb[0], g = rgb[1], b = rgb[2];
  const int half = 1 << 15;
  const int y = 11966 * r + 40254 * g + 4064 * b;    // 219/255 * (0.2126, 0.7152, 0.0722)
  const int cb = -6596 * r - 22189 * g + 28785 * b;  // 224/255 * (B - Y) / 1.8556
  const int cr = 28785 * r - 26145 * g - 2640 * b;   // 224/255 * (R - Y) / 1.5748
  return {static_cast<uint8_t>(16 + ((y + half) >> 16)), static_cast<uint8_t>(128 + ((cb + half) >> 16)),
          static_cast<uint8_t>(128 + ((cr + half) >> 16))};
}

class PipeSink final : public FrameSink {
 public:
  PipeSink(bool y4m, int width_px, int height_px, FrameRate fps, StopTest stop)
      : y4m_(y4m), width_px_(width_px), height_px_(height_px), out_(std::move(stop)) {
    header_ = "YUV4MPEG2 W" + std::to_string(width_px) + " H" + std::to_string(height_px) + " F" +
              std::to_string(fps.numerator) + ":" + std::to_string(fps.denominator) +
              " Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
  }

  void write(int, const Image& image) override {
    if (image.width_px != width_px_ || image.height_px != height_px_) {
      throw std::invalid_argument("pipe sink: the size of the frame differs from the size of the stream");
    }
    if (!y4m_) return out_.write(image.rgba);
    const std::string mark = std::exchange(header_, "") + "FRAME\n";
    const std::size_t pixels = image.pixel_count();
    buffer_.resize(mark.size() + 3 * pixels);
    std::copy(mark.begin(), mark.end(), buffer_.begin());
    uint8_t* plane = buffer_.data() + mark.size();
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto yuv = yuv_from_rgb(&image.rgba[4 * i]);
      for (std::size_t c = 0; c < 3; ++c) plane[c * pixels + i] = yuv[c];
    }
    out_.write(buffer_);
  }
  void close() override {}

 private:
  bool y4m_;
  int width_px_, height_px_;
  StandardOutput out_;
  std::string header_;
  std::vector<uint8_t> buffer_;
};

}  // namespace

std::unique_ptr<FrameSink> make_pipe_sink(bool y4m, int width_px, int height_px, FrameRate fps,
                                          StopTest stop) {
  if (width_px <= 0 || height_px <= 0 || fps.numerator <= 0 || fps.denominator <= 0 ||
      fps.per_second() > 1000) {
    throw std::invalid_argument("pipe sink: needs a size, and a frame rate in (0, 1000]");
  }
  if (::isatty(STDOUT_FILENO)) {
    throw std::invalid_argument("standard output is a terminal; send the frames to a program or a file");
  }
  return std::make_unique<PipeSink>(y4m, width_px, height_px, fps, std::move(stop));
}

}  // namespace offstage::render
