#include "producer/run/output_lock.h"

#include <chrono>
#include <thread>
#include <tuple>

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/run/output.h"
#include "render/error.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

/// Describes this process: "process 123 on HOST, since 2026-01-02 03:04:05".
std::string owner_text() {
  char host[256] = {};
  ::gethostname(host, sizeof host - 1);
  return fmt::format("process {} on {}, since {:%Y-%m-%d %H:%M:%S}\n", ::getpid(), host,
                     fmt::localtime(std::time(nullptr)));
}

std::string owner_in(int fd) {
  char text[300] = {};
  const ssize_t size = ::pread(fd, text, sizeof text - 1, 0);
  const std::string owner =
      render::one_line(std::string(text, size > 0 ? static_cast<std::size_t>(size) : 0));
  return owner.empty() ? "another process" : owner;
}

}  // namespace

OutputLock::OutputLock(fs::path file, const std::string& output) : file_(std::move(file)) {
  if (!take(LOCK_EX, output)) refuse(output);
  sign();
}

OutputLock OutputLock::of_part(fs::path file, const std::string& output,
                               const std::function<bool()>& may_share) {
  OutputLock lock;
  lock.file_ = std::move(file);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (true) {
    const bool alone = !may_share();
    if (lock.take(alone ? LOCK_EX : LOCK_SH, output)) {
      if (alone) lock.sign();
      return lock;
    }
    if (interrupt_signal()) throw Interrupted(interrupt_signal());
    if (std::chrono::steady_clock::now() > deadline) lock.refuse(output);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

/// Writes a description of this process to the file. On a full disk, the file stays empty.
void OutputLock::sign() {
  const std::string owner = owner_text();
  if (lock_ && ::ftruncate(lock_.fd(), 0) == 0 && ::pwrite(lock_.fd(), owner.data(), owner.size(), 0) < 0)
    std::ignore = ::ftruncate(lock_.fd(), 0);
}

void OutputLock::refuse(const std::string& output) {
  const std::string owner = owner_in(lock_.fd());
  lock_.close();  // so that the destructor does not remove the file of the other process
  throw OutputError(output + ": is being written by " + owner +
                    "; wait for its end, or choose another output");
}

OutputLock::~OutputLock() {
  // The last holder removes the file.
  if (lock_ && ::flock(lock_.fd(), LOCK_EX | LOCK_NB) == 0) ::unlink(file_.c_str());
}

OutputLock::OutputLock(OutputLock&& other) noexcept
    : file_(std::move(other.file_)), lock_(std::move(other.lock_)) {}

OutputLock& OutputLock::operator=(OutputLock&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(lock_, other.lock_);
  return *this;
}

void OutputLock::share() {
  if (lock_) ::flock(lock_.fd(), LOCK_SH);
}

bool OutputLock::take(int mode, const std::string& output) {
  constexpr int kTries = 100;  // the file is opened again if its owner removed it between open and lock
  for (int i = 0; i < kTries; ++i) {
    lock_ = render::Descriptor(
        ::open(file_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666));
    if (!lock_) render::throw_file_error(file_, "cannot be created");
    if (::flock(lock_.fd(), mode | LOCK_NB) != 0) {
      if (errno == EWOULDBLOCK) return false;
      log("warning: {}: this file system has no locks; make sure that no other render writes here\n", output);
      lock_.close();
      return true;
    }
    struct stat opened {
    }, there{};
    if (::fstat(lock_.fd(), &opened) == 0 && ::stat(file_.c_str(), &there) == 0 &&
        opened.st_ino == there.st_ino)
      return true;
  }
  return false;
}

fs::path OutputLock::beside(const fs::path& output) {
  constexpr std::size_t kLongest = 240;  // a file name may have 255 bytes
  return output.parent_path() / ("." + output.filename().string().substr(0, kLongest) + ".lock");
}

fs::path OutputLock::inside(const fs::path& folder) {
  return folder / ".offstage.lock";
}

}  // namespace offstage::producer
