#include "producer/base/scene_folder.h"

#include <system_error>

#include "producer/base/shipped_files.h"
#include "render/error.h"
#include "render/file_io.h"
#include "render/mesh_io.h"

namespace offstage::producer {
namespace {

std::vector<std::filesystem::path> all_folders(const std::filesystem::path& path,
                                               const std::vector<std::string>& allowed) {
  std::vector<std::filesystem::path> folders = {path};
  for (const std::string& folder : allowed) {
    std::error_code error;
    if (!std::filesystem::is_directory(folder, error))
      throw render::FileError(render::escaped(folder) + ": not a folder; --allow needs a folder");
    folders.emplace_back(folder);
  }
  for (const std::filesystem::path& shipped :
       {shipped_folder("assets/models", "assets/models"),
        shipped_folder("assets/pictures", "assets/pictures"), shipped_folder("presets", "effects/presets")})
    if (!shipped.empty()) folders.push_back(shipped);
  return folders;
}

}  // namespace

SceneFolder::SceneFolder(std::filesystem::path path, const std::vector<std::string>& allowed)
    : path_(std::move(path)), inputs_(all_folders(path_, allowed)) {}

std::string SceneFolder::wrong_place(const std::filesystem::path& file) const {
  return inputs_.contain(file) ? std::string() : render::outside_of_folders(file);
}

std::string SceneFolder::wrong_file(const std::filesystem::path& file) const {
  const std::filesystem::path whole = render::split_node(file).file;
  if (std::string wrong = wrong_place(whole); !wrong.empty()) return wrong;
  std::error_code error;
  return std::filesystem::is_regular_file(whole, error) ? "" : "there is no file '" + file.string() + "'";
}

}  // namespace offstage::producer
