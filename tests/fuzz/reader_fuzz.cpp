// Reads any bytes as a model file of each ending by the confined reader. The result must be a model or a
// FileError, never a crash of the caller. The reader runs in a child, so that no fuzzer sees its coverage.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "render/error.h"
#include "render/mesh_io.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const std::filesystem::path folder = [] {
    std::string name = (std::filesystem::temp_directory_path() / "offstage-fuzz-XXXXXX").string();
    return std::filesystem::path(mkdtemp(name.data()));
  }();
  static constexpr const char* kEndings[] = {".obj", ".ply", ".stl", ".gltf", ".glb",
                                             ".dae", ".fbx", ".3mf", ".png"};
  if (size < 1) return 0;
  const std::string ending = kEndings[data[0] % std::size(kEndings)];
  const std::filesystem::path file = folder / ("m" + ending);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size - 1));
  try {
    if (ending == ".png")
      offstage::render::read_texture(file);
    else
      offstage::render::read_model(file);
  } catch (const offstage::render::FileError&) {
  }
  return 0;
}
