#include "tune/session.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace offstage::tune {
namespace {

TEST(Sessions, ReadFilesOutsideOfTheScenesFolderOnlyIfAllowed) {
  namespace fs = std::filesystem;
  std::string name = (fs::temp_directory_path() / "offstage-session-XXXXXX").string();
  const fs::path folder = mkdtemp(name.data());
  fs::create_directories(folder / "scene");
  std::ofstream(folder / "part.json") << R"({"output": {"duration": 0.1}, "render": {"size": [64, 36]}})";
  const std::string scene = (folder / "scene/s.json").string();
  std::ofstream(scene) << R"({"include": ["../part.json"]})";
  EXPECT_EQ(Session(scene, {}).state()["errors"].size(), 1u);
  EXPECT_EQ(Session(scene, {}, {folder.string()}).state()["errors"].size(), 0u);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace offstage::tune
