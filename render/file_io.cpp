#include "render/file_io.h"

#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "render/error.h"

namespace offstage::render {

int Descriptor::close() {
  const int fd = std::exchange(fd_, -1);
  return fd >= 0 && ::close(fd) != 0 ? errno : 0;
}

std::string system_reason(int error) {
  return std::generic_category().message(error);
}

void throw_file_error(const std::filesystem::path& path, const std::string& what, int error) {
  throw FileError(path.string() + ": " + what + ": " + system_reason(error));
}

bool StopDeadline::exhausted() {
  constexpr std::chrono::seconds kGrace(3);
  const auto now = std::chrono::steady_clock::now();
  if (!asked_ && stop_ && stop_()) {
    asked_ = true;
    since_ = now;
  }
  return asked_ && now - since_ > kGrace;
}

int write_all(int fd, std::span<const uint8_t> bytes, const StopTest& stop) {
  StopDeadline patience(stop);
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      patience.progressed();
    } else if (errno == EAGAIN) {  // the descriptor is non-blocking
      if (patience.exhausted()) return ECANCELED;
      pollfd ready{fd, POLLOUT, 0};
      ::poll(&ready, 1, StopDeadline::kInterval_ms);
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

std::vector<uint8_t> read_file(const std::filesystem::path& path, uint64_t max_bytes) {
  // O_NONBLOCK is needed, because opening a named pipe would otherwise wait for its writer.
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat info {};
  if (!file || ::fstat(file.fd(), &info) != 0) throw_file_error(path, "cannot be opened");
  if (!S_ISREG(info.st_mode)) throw FileError(path.string() + ": is not a regular file");
  if (static_cast<uint64_t>(info.st_size) > max_bytes) {
    throw FileError(path.string() + ": is larger than " + std::to_string(max_bytes >> 20) + " MiB");
  }
  std::vector<uint8_t> bytes(static_cast<std::size_t>(info.st_size));
  std::size_t size = 0;
  while (size < bytes.size()) {
    const ssize_t got = ::read(file.fd(), bytes.data() + size, bytes.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw_file_error(path, "cannot be read");
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  bytes.resize(size);
  return bytes;
}

std::string read_text_file(const std::filesystem::path& path, uint64_t max_bytes) {
  const std::vector<uint8_t> bytes = read_file(path, max_bytes);
  return {bytes.begin(), bytes.end()};
}

void create_parent_folders(const std::filesystem::path& file) {
  std::error_code error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  if (error) throw FileError(file.parent_path().string() + ": cannot be created: " + error.message());
}

std::string escaped(const std::string& text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else if (byte < 0x20 || byte == 0x7F)
      out += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
    else
      out += c;
  }
  return out;
}

std::string one_line(const std::string& text) {
  std::string line;
  bool pending_break = false;
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      pending_break = !line.empty();
    } else if (pending_break && (c == ' ' || c == '\t')) {
      continue;
    } else {
      if (std::exchange(pending_break, false)) line += "; ";
      line += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return line;
}

}  // namespace offstage::render
