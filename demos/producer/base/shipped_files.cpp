#include "producer/base/shipped_files.h"

#include <cstdlib>
#include <system_error>

#include "producer/base/version.h"
#include "render/mesh_io.h"

namespace offstage::producer {

namespace fs = std::filesystem;

fs::path shipped_folder(std::string_view installed, std::string_view source) {
  std::error_code error;
  if (const char* data = std::getenv("OFFSTAGE_DATA"); data && *data) {
    const fs::path named = fs::path(data) / installed;
    if (fs::is_directory(named, error)) return named;
  }
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path beside = program.parent_path().parent_path() / "share/offstage" / installed;
  if (!error && fs::is_directory(beside, error)) return beside;
  const fs::path compiled = fs::path(source_folder()) / source;
  return fs::is_directory(compiled, error) ? compiled : fs::path();
}

fs::path model_file(const std::string& name, const SceneFolder& scene_folder) {
  const fs::path beside = scene_folder / name;
  std::error_code error;
  if (fs::path(name).has_parent_path() || fs::exists(render::split_node(beside).file, error)) return beside;
  const fs::path shipped = shipped_folder("assets/models", "assets/models") / name;
  return fs::exists(render::split_node(shipped).file, error) ? shipped : beside;
}

}  // namespace offstage::producer
