#pragma once
/// A folder for unfinished or temporary files of one run.

#include <filesystem>
#include <string>

namespace offstage::producer {

/// A hidden folder beside an output. It is on the same file system, so finished files can be moved by a
/// rename. The destructor removes the folder and the files in it.
class HiddenFolder {
 public:
  /// Creates the folder ".OUTPUT.PURPOSE-NUMBER". Throws std::filesystem::filesystem_error if that fails.
  HiddenFolder(const std::filesystem::path& output, const std::string& purpose);
  ~HiddenFolder();
  HiddenFolder(const HiddenFolder&) = delete;
  HiddenFolder& operator=(const HiddenFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace offstage::producer
