#pragma once
/// A folder for unfinished or temporary files of one run.

#include <filesystem>
#include <string>

namespace offstage::producer {

/// A hidden folder beside an output, so that a file is moved from one to the other by a rename. It is removed
/// with the object.
class HiddenFolder {
 public:
  /// Creates the folder ".OUTPUT.PURPOSE-NUMBER". Throws std::filesystem::filesystem_error.
  HiddenFolder(const std::filesystem::path& output, const std::string& purpose);
  ~HiddenFolder();
  HiddenFolder(const HiddenFolder&) = delete;
  HiddenFolder& operator=(const HiddenFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace offstage::producer
