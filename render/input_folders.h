#pragma once
/// Folders that may contain the files named by a scene or a model.

#include <filesystem>
#include <vector>

namespace offstage::render {

class InputFolders {
 public:
  /// Makes an empty set of folders, which allows no file to be read.
  InputFolders() = default;
  /// The folders and their subfolders; symbolic links are resolved in the constructor. Folders that do not
  /// exist are ignored.
  explicit InputFolders(const std::vector<std::filesystem::path>& folders);

  /// Returns whether a file, with all of its links resolved, is in one of the folders.
  bool contain(const std::filesystem::path& file) const;
  const std::vector<std::filesystem::path>& folders() const { return folders_; }

 private:
  std::vector<std::filesystem::path> folders_;
};

}  // namespace offstage::render
