// Every file of assimp's own test models, some of them broken on purpose, is read or refused with one line.

#include <algorithm>
#include <chrono>

#include <gtest/gtest.h>

#include "render/error.h"
#include "render/mesh_io.h"
#include "scratch.h"

extern "C" [[gnu::weak]] void __asan_init();

namespace offstage::render {
namespace {

std::filesystem::path corpus_folder() {
  const char* chosen = std::getenv("OFFSTAGE_MODEL_CORPUS");
  return chosen ? chosen : "/usr/share/assimp/models";
}

std::vector<std::filesystem::path> corpus_files() {
  std::vector<std::filesystem::path> files;
  std::error_code none;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(corpus_folder(), none)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

bool is_sound(const Mesh& mesh) {
  const std::size_t n = mesh.positions.size();
  const auto finite = [](const auto& v) { return v.allFinite(); };
  return !mesh.indices.empty() && mesh.indices.size() % 3 == 0 && mesh.normals.size() == n &&
         (mesh.uvs.empty() || mesh.uvs.size() == n) &&
         std::all_of(mesh.indices.begin(), mesh.indices.end(), [n](uint32_t i) { return i < n; }) &&
         std::all_of(mesh.positions.begin(), mesh.positions.end(), finite) &&
         std::all_of(mesh.normals.begin(), mesh.normals.end(), finite) &&
         std::all_of(mesh.uvs.begin(), mesh.uvs.end(), finite);
}

/// Returns whether the poses of all animations, at several times, are finite.
bool moves_soundly(const ModelRig& rig) {
  for (std::size_t clip = 0; clip < rig.clips.size(); ++clip)
    for (const float fraction : {0.0f, 0.3f, 1.0f}) {
      const RigPose pose = pose_at(rig, static_cast<int>(clip), fraction * rig.clips[clip].duration);
      for (const RigSurface& surface : rig.surfaces)
        for (const Vector3f& p : deformed(rig, surface, pose).positions)
          if (!p.allFinite()) return false;
    }
  return true;
}

/// Returns whether some triangles of a model are opaque. This detects a reader that leaves alpha at 0 because
/// the format has none.
bool has_something_opaque(const Model& model) {
  return std::ranges::any_of(model.parts, [&](const Model::Part& part) {
    const Material& look = model.materials[static_cast<std::size_t>(part.material)];
    const bool vertices = !look.vertex_colors || part.mesh.colors.empty() ||
                          std::ranges::any_of(part.mesh.colors, [](const Vector4f& c) { return c.w() > 0; });
    return look.color.w() > 0 && vertices;
  });
}

/// The results of reading many files. The fault of a file is an empty string if there is none.
struct Tally {
  int loaded = 0, refused = 0;
  double slowest_s = 0;

  std::string read(const std::filesystem::path& path) {
    const auto start = std::chrono::steady_clock::now();
    std::string fault;
    try {
      const Model model = read_model(path, {}, {}, true);
      ++loaded;
      if (!moves_soundly(model.rig)) fault = "unsound animation";
      const bool sound = std::all_of(model.parts.begin(), model.parts.end(), [&](const Model::Part& part) {
        return is_sound(part.mesh) && part.material >= 0 &&
               part.material < static_cast<int>(model.materials.size());
      });
      if (!sound || model.parts.empty() || model.bounds().isEmpty())
        fault = "unsound model";
      else if (!has_something_opaque(model))
        fault = "invisible model";
    } catch (const FileError& error) {
      ++refused;
      const std::string message = error.what();
      if (message.empty() || message.find('\n') != std::string::npos) fault = "not one line: " + message;
      if (message.find("crashed") != std::string::npos) fault = message;
    }
    slowest_s =
        std::max(slowest_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    return fault;
  }
};

/// Returns n: the tests read every n-th file of a corpus. With sanitizers, reading takes three times as long.
std::size_t corpus_step() {
  const char* step = std::getenv("OFFSTAGE_CORPUS_STEP");
  return step == nullptr ? 1 : static_cast<std::size_t>(std::stoi(step));
}

/// Returns whether the tested libraries are compiled with the address sanitizer. The test itself may be
/// compiled without it.
bool is_address_sanitized() {
  return __asan_init != nullptr;
}

TEST(ModelCorpus, EveryFileIsVisibleOrRefusedInOneLine) {
  const auto files = corpus_files();
  ASSERT_GT(files.size(), 100u) << corpus_folder()
                                << ": install the Debian package assimp-testmodels, or set "
                                << "OFFSTAGE_MODEL_CORPUS to a folder of models";
  Tally tally;
  for (std::size_t i = 0; i < files.size(); i += corpus_step()) {
    const auto& file = files[i];
    // AddressSanitizer's allocator ends the process by design where others throw.
    if (is_address_sanitized() && file.filename() == "OutOfMemory.off") continue;
    EXPECT_EQ(tally.read(file), "") << file;
  }
  RecordProperty("loaded", tally.loaded);
  RecordProperty("refused", tally.refused);
  RecordProperty("slowest_ms", static_cast<int>(1000 * tally.slowest_s));
  EXPECT_GE(tally.loaded, (tally.loaded + tally.refused) * 2 / 5);
  EXPECT_LT(tally.slowest_s, 10);
}

// The controllers and skinned hands of the npm package @webxr-input-profiles/assets.
TEST(LongModelCorpus, EveryGltfModelOfTheRegistryLoads) {
  const char* folder = std::getenv("OFFSTAGE_MESHES");
  ASSERT_NE(folder, nullptr)
      << "OFFSTAGE_MESHES must name a folder of models: tests/run.sh --long fetches them";
  Tally tally;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(folder) / "gltf"))
    EXPECT_EQ(tally.read(entry.path()), "") << entry.path();
  EXPECT_GE(tally.loaded, 75);
  // The others have no triangles.
  EXPECT_LE(tally.refused, 7);
  EXPECT_LT(tally.slowest_s, 10);
}

}  // namespace
}  // namespace offstage::render
