// Finds the files of a scene, and detects their changes.

#include "producer/run/watch.h"

#include <chrono>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <stdlib.h>

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

class Watch : public testing::Test {
 protected:
  Watch() {
    std::string pattern = (fs::temp_directory_path() / "offstage-watch-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    fs::create_directories(folder_ / "parts");
  }
  ~Watch() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  fs::path folder_;
};

TEST_F(Watch, FilesAreFoundThroughIncludesAndModels) {
  write("s.json", R"({"include": ["parts/i.json"], "description": "see https://a.b/c and 3.5 m",
                      "bodies": [{"shape": {"type": "mesh", "file": "m.obj"}}]})");
  write("parts/i.json", R"({"include": ["missing.json"], "materials": [{"texture": "wood.png"}]})");
  write("m.obj", "mtllib m.mtl\nv 0 0 0\n");
  write("m.mtl", "newmtl a\nmap_Kd -s 1 1 1 bark.jpg\n");
  const auto files = files_of_scene(folder_ / "s.json", {"a=1", "bodies.0.shape.file=other.glb"});
  for (const char* name :
       {"s.json", "parts/i.json", "parts/missing.json", "wood.png", "m.obj", "m.mtl", "bark.jpg"})
    EXPECT_TRUE(files.contains(folder_ / name)) << name;
  EXPECT_FALSE(files.contains(folder_ / "3.5"));
}

TEST_F(Watch, ABrokenSceneStillNamesItsFiles) {
  write("s.json", R"({"include": ["i.json"], "bodies": [ oops )");
  write("i.json", R"({"materials": [{"texture": "wood.png"}]})");
  const auto files = files_of_scene(folder_ / "s.json", {});
  EXPECT_TRUE(files.contains(folder_ / "i.json"));
  EXPECT_TRUE(files.contains(folder_ / "wood.png"));
}

TEST_F(Watch, ChangesAreSeenWithAndWithoutNotifications) {
  using enum FileWatch::Method;
  for (const auto method : {notified, polling}) {
    write("a.json", "1");
    const std::set<fs::path> files = {folder_ / "a.json", folder_ / "later.json"};
    const auto change = [&](const auto& act) {
      FileWatch watch(files, method);
      EXPECT_EQ(watch.method(), method);
      EXPECT_FALSE(watch.changed());
      act();
      for (int i = 0; i < 20 && !watch.changed(); ++i) watch.wait(milliseconds(1000));
      return watch.changed();
    };
    EXPECT_TRUE(change([&] { write("a.json", "22"); })) << "written";
    EXPECT_TRUE(change([&] { write("later.json", "1"); })) << "made";
    EXPECT_TRUE(change([&] { fs::rename(folder_ / "later.json", folder_ / "a.json"); }))
        << "put in its place";
    EXPECT_TRUE(change([&] { fs::remove(folder_ / "a.json"); })) << "removed";
  }
}

TEST_F(Watch, NotificationsComeAtOnceAndOtherFilesAreIgnored) {
  write("a.json", "1");
  FileWatch watch({folder_ / "a.json"});
  write("b.json", "1");
  watch.wait(milliseconds(100));
  EXPECT_FALSE(watch.changed());
  const auto start = std::chrono::steady_clock::now();
  std::jthread writer([&] {
    std::this_thread::sleep_for(milliseconds(50));
    write("a.json", "333");
  });
  while (!watch.changed() && std::chrono::steady_clock::now() - start < milliseconds(20000))
    watch.wait(milliseconds(20000));
  EXPECT_LT(std::chrono::steady_clock::now() - start, milliseconds(10000));
}

TEST_F(Watch, TouchingAFileDoesNotChangeItsHash) {
  write("a.json", "1");
  const std::set<fs::path> files = {folder_ / "a.json", folder_ / "b.json"};
  const std::string hash = contents_hash(files);
  write("a.json", "1");
  EXPECT_EQ(contents_hash(files), hash);
  write("b.json", "");
  EXPECT_NE(contents_hash(files), hash) << "empty is not missing";
  write("a.json", "2");
  EXPECT_NE(contents_hash(files), hash);
}

}  // namespace
}  // namespace offstage::producer
