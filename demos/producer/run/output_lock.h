#pragma once
/// A lock that allows only one process to write an output. The lock is advisory (flock). The kernel releases
/// it when the process ends, so a killed run leaves no lock behind.

#include <filesystem>
#include <functional>
#include <string>

#include "render/file_io.h"

namespace offstage::producer {

class OutputLock {
 public:
  /// Makes an object that holds no lock.
  OutputLock() = default;
  /// Takes an exclusive lock on `file`. If another process writes `output`, throws OutputError, whose message
  /// names that process. On a file system without locks, prints a warning and continues.
  OutputLock(std::filesystem::path file, const std::string& output);
  /// Releases the lock. Removes its file, unless other processes share the lock.
  ~OutputLock();
  OutputLock(OutputLock&& other) noexcept;
  OutputLock& operator=(OutputLock&& other) noexcept;

  /// Takes the lock of an output that several processes write in parts. The lock is shared if `may_share`
  /// returns true. Otherwise it is exclusive: the caller prepares the output and then calls share(). Waits up
  /// to ten seconds while another process prepares the output, then throws OutputError.
  static OutputLock of_part(std::filesystem::path file, const std::string& output,
                            const std::function<bool()>& may_share);
  /// Changes an exclusive lock to a shared one, so that other processes can take it, too.
  void share();

  /// Return the file of the lock: ".NAME.lock" beside an output file, or ".offstage.lock" in an output
  /// folder.
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
