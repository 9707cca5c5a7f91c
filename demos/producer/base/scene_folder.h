#pragma once
/// Folders from which a scene may read files: the scene's own folder, the folders of the installation, and
/// the folders given by --allow.

#include <filesystem>
#include <string>
#include <vector>

#include "render/input_folders.h"

namespace offstage::producer {

/// Greatest size of a text (a scene, an include, a preset, a JSON file written by offstage).
inline constexpr uint64_t kMostTextBytes = uint64_t{256} << 20;

class SceneFolder {
 public:
  SceneFolder(std::filesystem::path path = {}, const std::vector<std::string>& allowed = {});
  SceneFolder(const char* path) : SceneFolder(std::filesystem::path(path)) {}

  const std::filesystem::path& path() const { return path_; }
  const render::InputFolders& inputs() const { return inputs_; }
  std::filesystem::path operator/(const std::filesystem::path& file) const { return path_ / file; }
  /// Returns an error message for a file outside of all the folders, with symbolic links resolved; empty if
  /// it is inside.
  std::string wrong_place(const std::filesystem::path& file) const;
  /// Returns an error message for a file that wrong_place() refuses or that is not a regular file; empty if
  /// it can be read. The path may end in #NODE.
  std::string wrong_file(const std::filesystem::path& file) const;

 private:
  std::filesystem::path path_;
  render::InputFolders inputs_;
};

}  // namespace offstage::producer
