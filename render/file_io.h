#pragma once
/// Descriptors and whole files for the readers, writers and sinks of this folder: POSIX calls that own what
/// they open, finish what they start and say why they failed. Private to render.

#include <cerrno>
#include <cstdint>
#include <filesystem>
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

/// Writes everything; returns the error number that stopped it, or 0.
int write_all(int fd, std::span<const uint8_t> bytes);

/// A regular file's bytes. Throws FileError, also for one above `max_bytes`.
std::vector<uint8_t> read_file(const std::filesystem::path& path, uint64_t max_bytes);

/// Makes the folders that are to hold `file`. Throws FileError.
void create_parent_folders(const std::filesystem::path& file);

/// "a\nb  \n" becomes "a; b": messages are one line.
std::string one_line(const std::string& text);

}  // namespace offstage::render
