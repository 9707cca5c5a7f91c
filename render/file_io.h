#pragma once
/// Descriptors and whole files for the readers, writers and sinks of this folder: POSIX calls that own what
/// they open, finish what they start and say why they failed. No wait here lasts for ever: regular files are
/// the only ones that are read, and a writer that waits for its reader asks a StopTest.

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

/// Owns a file descriptor; -1 is none.
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
  /// The system's error number, 0 if all is well; some file systems report a failed write only here.
  int close();

 private:
  int fd_ = -1;
};

/// The text of an errno value.
std::string system_reason(int error);

/// Throws FileError "PATH: WHAT: REASON".
[[noreturn]] void throw_file_error(const std::filesystem::path& path, const std::string& what,
                                   int error = errno);

/// Asked during waits; true asks to end them. Empty: never.
using StopTest = std::function<bool()>;

/// Ends a wait for another program: after a request to stop, the program has three seconds to go on.
class Patience {
 public:
  static constexpr int kInterval_ms = 100;  ///< between two questions

  explicit Patience(const StopTest& stop) : stop_(stop) {}
  /// The other program took or gave something.
  void progressed() { asked_ = false; }
  bool exhausted();

 private:
  const StopTest& stop_;
  bool asked_ = false;                                // to stop ...
  std::chrono::steady_clock::time_point since_ = {};  // ... at this time
};

/// Writes everything; returns the error number that stopped it, or 0. A descriptor that is not blocking is
/// waited for; ECANCELED if Patience ended that wait.
int write_all(int fd, std::span<const uint8_t> bytes, const StopTest& stop = {});

/// The bytes of a regular file. Named pipes, devices and folders are refused without a wait. Throws
/// FileError, also for a file above `max_bytes`.
std::vector<uint8_t> read_file(const std::filesystem::path& path, uint64_t max_bytes);
/// The same as text.
std::string read_text_file(const std::filesystem::path& path, uint64_t max_bytes);

/// Makes the folders that are to hold `file`. Throws FileError.
void create_parent_folders(const std::filesystem::path& file);

/// Control characters as escapes ("a\\nb"), so that a name cannot break a line or steer a terminal.
std::string escaped(const std::string& text);

/// "a\nb  \n" becomes "a; b": messages are one line.
std::string one_line(const std::string& text);

}  // namespace offstage::render
