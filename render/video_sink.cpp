#include <algorithm>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <sstream>
#include <stdexcept>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "render/child_process.h"
#include "render/error.h"
#include "render/output_file.h"
#include "render/sink.h"
#include "render/video_format.h"
#include "render/video_frames.h"

namespace offstage::render {
namespace {

constexpr std::size_t kCaptureBytes = 1 << 16;
constexpr std::chrono::seconds kStall{300};  // an encoder that reads no frame for this time is stuck

std::string ffmpeg_program() {
  const char* chosen = std::getenv("OFFSTAGE_FFMPEG");
  return chosen && *chosen ? chosen : "ffmpeg";
}

/// Returns the names of the encoders that a program offers. Throws UnavailableError.
std::vector<std::string> list_encoders(const std::string& program) {
  BoundedCapture output(kCaptureBytes);
  ChildProcess child({program, "-hide_banner", "-encoders"}, -1, output.fd(), -1);
  std::optional<std::string> failure;
  if (child.error() != 0) {
    failure = system_reason(child.error());
  } else {
    failure = child.wait_for(std::chrono::seconds(20));
  }
  if (failure) {
    throw UnavailableError("ffmpeg cannot be run as '" + program + "' (" + *failure +
                           "): install the Debian package ffmpeg, or set OFFSTAGE_FFMPEG to its path");
  }
  std::vector<std::string> names;
  std::istringstream lines(output.text());
  for (std::string line; std::getline(lines, line);) {  // " V....D libx264   description"
    std::string flags, name;
    if (std::istringstream(line) >> flags >> name && flags.size() == 6 && flags[0] == 'V')
      names.push_back(name);
  }
  return names;
}

/// Returns the same as list_encoders(), but runs each program only once per process.
std::vector<std::string> known_encoders(const std::string& program) {
  static std::mutex mutex;
  static std::string known_program;
  static std::vector<std::string> encoders;
  const std::lock_guard lock(mutex);
  if (program != known_program) {
    encoders = list_encoders(program);
    known_program = program;
  }
  return encoders;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The two ends of a socket pair: one for ffmpeg, one for this process. It is a socket instead of a pipe,
/// because send() can be told not to raise SIGPIPE.
struct FrameChannel {
  Descriptor ours, theirs;

  FrameChannel() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      throw UnavailableError("no channel to ffmpeg: " + system_reason(errno));
    }
    ours = Descriptor(ends[0]);
    theirs = Descriptor(ends[1]);
  }
};

/// Sends all bytes. Returns 0 or an error number: ECANCELED after a request to stop, EAGAIN if the encoder
/// hangs.
int send_all(int socket, std::span<const uint8_t> bytes, const StopTest& stop) {
  StopDeadline patience(stop);
  auto last = std::chrono::steady_clock::now();
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
      patience.progressed();
      last = std::chrono::steady_clock::now();
    } else if (errno == EAGAIN) {
      if (patience.exhausted()) return ECANCELED;
      if (std::chrono::steady_clock::now() - last > kStall) return EAGAIN;
      pollfd ready{socket, POLLOUT, 0};
      ::poll(&ready, 1, StopDeadline::kInterval_ms);
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

/// Creates the folder of a film and removes leftovers of killed runs.
const std::filesystem::path& prepared(const std::filesystem::path& target) {
  create_parent_folders(target);
  remove_leftovers(target.parent_path());
  return target;
}

class VideoSink final : public FrameSink {
 public:
  VideoSink(const VideoDef& def, const VideoFormat& format)
      : def_(def),
        encoder_(format.encoder),
        file_(prepared(def.path)),
        words_(kCaptureBytes),
        process_(encoder_command(ffmpeg_program(), def, format, file_.path()), channel_.theirs.fd(), -1,
                 words_.fd()) {
    channel_.theirs.close();
    if (process_.error() != 0)
      throw UnavailableError("ffmpeg cannot be run: " + system_reason(process_.error()));
  }

  void write(int, const Image& image) override {
    if (image.width_px != def_.width_px || image.height_px != def_.height_px) {
      throw std::invalid_argument("video sink: the frame has another size than the film");
    }
    if (!channel_.ours) throw std::logic_error("video sink: it is closed");
    const int error = send_all(channel_.ours.fd(), image.rgba, def_.stop);
    if (error == EAGAIN || error == ECANCELED) process_.kill();
    if (error == ECANCELED) throw StoppedError(def_.path.string() + ": ffmpeg takes no more frames");
    if (error != 0) fail(process_.wait());
    ++frames_;
  }

  void close() override {
    if (closed_) return;
    if (frames_ == 0) throw FileError(def_.path.string() + ": no frame was written");
    channel_.ours.close();
    if (const auto failure = process_.wait(def_.stop)) fail(failure);
    // ffmpeg succeeds even if the disk was full for its last bytes, so the film counts as written only when
    // its frames are found in it.
    const double seconds = def_.fps.seconds(frames_);
    if (const std::string wrong = wrong_with_video(file_.path(), def_.path, frames_, seconds); !wrong.empty())
      throw FileError(def_.path.string() + ": the film was cut short (" + wrong + "); is the disk full?");
    file_.commit();
    closed_ = true;
  }

 private:
  [[noreturn]] void fail(const std::optional<std::string>& how) {
    channel_.ours.close();
    const std::string words = one_line(words_.text());
    throw FileError(def_.path.string() + ": ffmpeg (" + encoder_ + ") ended early with " +
                    how.value_or("exit code 0") + (words.empty() ? "" : ": " + words));
  }

  VideoDef def_;
  std::string encoder_;
  OutputFile file_;
  BoundedCapture words_;
  FrameChannel channel_;
  ChildProcess process_;  // the last member, so that ffmpeg ends before the file is destroyed
  int frames_ = 0;
  bool closed_ = false;
};

}  // namespace

void check_video(const VideoDef& def) {
  const VideoFormat& format = video_format(def);
  if (!contains(known_encoders(ffmpeg_program()), format.encoder)) {
    throw UnavailableError(def.path.string() + ": this ffmpeg has no encoder " + format.encoder + ", which " +
                           format.extension + " needs; the Debian package ffmpeg has it");
  }
}

std::unique_ptr<FrameSink> make_video_sink(const VideoDef& def) {
  check_video(def);
  return std::make_unique<VideoSink>(def, video_format(def));
}

std::vector<std::string> available_encoders() {
  std::vector<std::string> found;
  try {
    const std::vector<std::string> offered = known_encoders(ffmpeg_program());
    for (const VideoFormat& format : video_formats()) {
      if (contains(offered, format.encoder) && !contains(found, format.encoder))
        found.push_back(format.encoder);
    }
  } catch (const UnavailableError&) {
    return {};
  }
  return found;
}

}  // namespace offstage::render
