#pragma once
/// One writer for each output. The lock is advisory (flock) and held by the kernel for as long as its process
/// lives, so that a killed run leaves no lock behind.

#include <filesystem>
#include <functional>
#include <string>

#include "render/file_io.h"

namespace offstage::producer {

class OutputLock {
 public:
  /// Holds nothing.
  OutputLock() = default;
  /// Takes the lock that lies in `file`, for this process alone. Throws OutputError that names the owner if
  /// another process writes `output`. A file system without locks gets a warning instead.
  OutputLock(std::filesystem::path file, const std::string& output);
  /// Removes the file, unless others still share the lock.
  ~OutputLock();
  OutputLock(OutputLock&& other) noexcept;
  OutputLock& operator=(OutputLock&& other) noexcept;

  /// Takes the lock of an output that several processes write parts of: with them if `may_share` says so,
  /// else alone, to prepare the output and then share(). Waits up to ten seconds while another one prepares
  /// it.
  static OutputLock of_part(std::filesystem::path file, const std::string& output,
                            const std::function<bool()>& may_share);
  /// Others may share it from now on.
  void share();

  /// Of an output that is a file: ".NAME.lock" beside it; of a folder: ".offstage.lock" in it.
  static std::filesystem::path beside(const std::filesystem::path& output);
  static std::filesystem::path inside(const std::filesystem::path& folder);

 private:
  bool take(int mode, const std::string& output);
  void sign();
  [[noreturn]] void refuse(const std::string& output);

  std::filesystem::path file_;
  render::Descriptor lock_;
};

}  // namespace offstage::producer
