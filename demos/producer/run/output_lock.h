#pragma once
/// A lock that allows only one process to write an output. The lock is advisory (flock). The kernel holds it
/// as long as the process runs, so a killed run leaves no lock behind.

#include <filesystem>
#include <functional>
#include <string>

#include "render/file_io.h"

namespace offstage::producer {

class OutputLock {
 public:
  /// Holds no lock.
  OutputLock() = default;
  /// Takes an exclusive lock on `file`. Throws OutputError with the owner if another process writes `output`.
  /// A file system without locks causes a warning.
  OutputLock(std::filesystem::path file, const std::string& output);
  /// Removes the file, unless other processes share the lock.
  ~OutputLock();
  OutputLock(OutputLock&& other) noexcept;
  OutputLock& operator=(OutputLock&& other) noexcept;

  /// Takes the lock of an output whose parts are written by several processes. The lock is shared if
  /// `may_share` returns true. Otherwise it is exclusive: the caller prepares the output and then calls
  /// share(). Waits up to ten seconds while another process prepares the output.
  static OutputLock of_part(std::filesystem::path file, const std::string& output,
                            const std::function<bool()>& may_share);
  /// Lets other processes share the lock.
  void share();

  /// File of the lock: ".NAME.lock" beside an output file, ".offstage.lock" in an output folder.
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
