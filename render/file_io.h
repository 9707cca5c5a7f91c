#pragma once
<<<<<<< ours
/// Descriptors and whole files for the readers, writers and sinks of this folder: POSIX calls that own what
/// they open, finish what they start and say why they failed. Private to render.
=======
/// File descriptors and whole files for the readers, writers and sinks of this folder. The functions wrap
/// POSIX calls: they own what they open, retry partial writes and report why they failed. Every wait is
/// bounded: only regular files are read, and a writer that waits for its reader checks a StopTest.
>>>>>>> theirs

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace offstage::render {

/// Owns a file descriptor; -1 means none.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { close(); }

  int fd() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }
  /// Closes the descriptor and returns the errno value, 0 on success. Some file systems report a failed write
  /// only here.
  int close();

 private:
  int fd_ = -1;
};

/// The text of an errno value.
std::string system_reason(int error);

/// Throws FileError "PATH: WHAT: REASON".
[[noreturn]] void throw_file_error(const std::filesystem::path& path, const std::string& what,
                                   int error = errno);

<<<<<<< ours
/// Writes everything; returns the error number that stopped it, or 0.
int write_all(int fd, std::span<const uint8_t> bytes);

/// A regular file's bytes. Throws FileError, also for one above `max_bytes`.
std::vector<uint8_t> read_file(const std::filesystem::path& path, uint64_t max_bytes);
=======
/// A callback that is polled during waits; it returns true to end them. An empty one never does.
using StopTest = std::function<bool()>;

/// Bounds the wait for another program: after a request to stop, the program has three seconds to make
/// progress.
class Patience {
 public:
  static constexpr int kInterval_ms = 100;  ///< time between two polls

  explicit Patience(const StopTest& stop) : stop_(stop) {}
  /// To be called when the other program has read or written data.
  void progressed() { asked_ = false; }
  bool exhausted();

 private:
  const StopTest& stop_;
  bool asked_ = false;                                // to stop ...
  std::chrono::steady_clock::time_point since_ = {};  // ... at this time
};

/// Writes all bytes; returns the error number of a failure, or 0. Waits where the descriptor is non-blocking;
/// returns ECANCELED if Patience ended that wait.
int write_all(int fd, std::span<const uint8_t> bytes, const StopTest& stop = {});

/// Reads a regular file. Named pipes, devices and folders are refused without a wait. Throws FileError, also
/// for a file larger than `max_bytes`.
std::vector<uint8_t> read_file(const std::filesystem::path& path, uint64_t max_bytes);
/// Reads a regular file as text.
std::string read_text_file(const std::filesystem::path& path, uint64_t max_bytes);
>>>>>>> theirs

/// Creates the folders above `file`. Throws FileError.
void create_parent_folders(const std::filesystem::path& file);

<<<<<<< ours
/// "a\nb  \n" becomes "a; b": messages are one line.
=======
/// Replaces control characters by escapes ("a\\nb"), so that a name cannot break a line or control a
/// terminal.
std::string escaped(const std::string& text);

/// Turns "a\nb  \n" into "a; b", because messages are one line.
>>>>>>> theirs
std::string one_line(const std::string& text);

}  // namespace offstage::render
