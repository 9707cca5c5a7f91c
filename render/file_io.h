#pragma once
/// Descriptors and whole files for the readers, writers and sinks of this folder. The functions wrap POSIX
/// calls, handle partial reads and writes, and report the reason of a failure. No wait is unlimited: only
/// regular files are read, and a writer that waits for its reader polls a StopTest.

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
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
  /// Closes the descriptor. Returns the errno value, or 0 for success. Some file systems report a failed
  /// write only here.
  int close();

 private:
  int fd_ = -1;
};

/// Returns the text of an errno value.
std::string system_reason(int error);

/// Throws FileError "PATH: WHAT: REASON".
[[noreturn]] void throw_file_error(const std::filesystem::path& path, const std::string& what,
                                   int error = errno);

/// A function that is polled during waits and long work, and returns true to request their end. Empty: there
/// is no such request.
using StopTest = std::function<bool()>;

/// Limits the wait for another program: after a request to stop, the program has three seconds to make
/// progress.
class StopDeadline {
 public:
  static constexpr int kInterval_ms = 100;  ///< time between two polls

  explicit StopDeadline(const StopTest& stop) : stop_(stop) {}
  /// Must be called when the other program has read or written something.
  void progressed() { asked_ = false; }
  /// Polls the StopTest. Returns true if the three seconds are over.
  bool exhausted();

 private:
  const StopTest& stop_;
  bool asked_ = false;                                // whether a stop was requested ...
  std::chrono::steady_clock::time_point since_ = {};  // ... and when
};

/// Writes all bytes, and waits if the descriptor is non-blocking. Returns 0, an errno value, or ECANCELED if
/// StopDeadline ended the wait.
int write_all(int fd, std::span<const uint8_t> bytes, const StopTest& stop = {});

/// Returns the bytes of a regular file. Named pipes, devices and folders are refused at once. Throws
/// FileError, also for a file larger than `max_bytes`.
std::vector<uint8_t> read_file(const std::filesystem::path& path, uint64_t max_bytes);
/// Returns the text of a regular file, like read_file().
std::string read_text_file(const std::filesystem::path& path, uint64_t max_bytes);

/// Creates the parent folders of `file`. Throws FileError.
void create_parent_folders(const std::filesystem::path& file);

/// Replaces control characters by escapes ("a\\nb"), so that a name cannot break a line or control a
/// terminal.
std::string escaped(const std::string& text);

/// Converts "a\nb  \n" to "a; b", because messages have one line.
std::string one_line(const std::string& text);

}  // namespace offstage::render
