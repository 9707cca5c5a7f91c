#pragma once
/// Folders that files named by a scene or a model may lie in.

#include <filesystem>
#include <vector>

namespace offstage::render {

class InputFolders {
 public:
  /// Nothing may be read.
  InputFolders() = default;
  /// Folders and all below them; symbolic links are resolved now. One that does not exist is left out.
  explicit InputFolders(const std::vector<std::filesystem::path>& folders);

  /// Whether a file, all of its links resolved, is in one of the folders.
  bool contain(const std::filesystem::path& file) const;
  const std::vector<std::filesystem::path>& folders() const { return folders_; }

 private:
  std::vector<std::filesystem::path> folders_;
};

}  // namespace offstage::render
