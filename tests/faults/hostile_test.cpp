// Hostile files and names, closed descriptors, failing allocations.

#include <csignal>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "cli/program.h"
#include "faults/background.h"
#include "faults/injection_count.h"

namespace offstage::test {
namespace {

namespace fs = std::filesystem;

TEST(NamedPipe, IsRefusedAtOnceWhereverAFileIsRead) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::create_directory(folder / "goldens");
  ASSERT_EQ(mkfifo((folder / "goldens/s.json").c_str(), 0600), 0);
  write_file(folder / "include.json", R"({"include": ["pipe"]})");
  write_file(folder / "model.json", R"({"bodies": [{"shape": {"type": "mesh", "file": "pipe"}}]})");
  write_file(folder / "texture.json", R"({"materials": [{"texture": "pipe"}]})");
  write_file(folder / "s.json", "{}");
  for (const char* command : {"validate pipe", "validate include.json", "validate model.json",
                              "validate texture.json", "compare s.json --golden goldens", "info pipe"}) {
    const Outcome run = offstage(command, folder.path(), "timeout -s KILL 20");
    EXPECT_GT(run.code, 0) << command;
    EXPECT_LT(run.code, 100) << command << " hung";
    EXPECT_NE(run.err.find("file"), std::string::npos) << run.err;
  }
}

TEST(EndlessDevice, AsAnIncludeIsRefused) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", R"({"include": ["/dev/zero"]})");
  const Outcome run = offstage("validate s.json --allow /dev", folder.path(), "timeout -s KILL 20");
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.err.find("s.json:1:"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("not a regular file"), std::string::npos) << run.err;
}

TEST(FileOutsideOfTheScenesFolder, IsReadOnlyIfItsFolderIsAllowed) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "scene");
  fs::create_directories(folder / "elsewhere");
  write_file(folder / "elsewhere/part.json", R"({"description": "x"})");
  write_file(folder / "elsewhere/tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_file(folder / "scene/include.json", R"({"include": ["../elsewhere/part.json"]})");
  write_file(folder / "scene/model.json",
             R"({"bodies": [{"motion": "static", "shape": {"type": "mesh", "file": "link.obj"}}]})");
  fs::create_symlink("../elsewhere/tri.obj", folder / "scene/link.obj");
  for (const char* scene : {"scene/include.json", "scene/model.json"}) {
    const Outcome refused = offstage(std::string("validate --quick ") + scene, folder.path());
    EXPECT_EQ(refused.code, 3) << scene;
    EXPECT_NE(refused.err.find("--allow"), std::string::npos) << refused.err;
    const Outcome allowed =
        offstage(std::string("validate --quick --allow elsewhere ") + scene, folder.path());
    EXPECT_EQ(allowed.code, 0) << allowed.err;
  }
}

TEST(BufferOutsideOfTheScenesFolder, IsReadOnlyIfItsFolderIsAllowed) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "scene");
  fs::create_directories(folder / "elsewhere");
  const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  write_file(folder / "elsewhere/corners.bin", {reinterpret_cast<const char*>(corners.data()), 36});
  write_file(folder / "scene/m.gltf",
             R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "buffers":[{"uri":"../elsewhere/corners.bin","byteLength":36}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})");
  write_file(folder / "scene/s.json",
             R"({"bodies": [{"motion": "static", "shape": {"type": "mesh", "file": "m.gltf"}}]})");
  EXPECT_EQ(offstage("validate --quick scene/s.json", folder.path()).code, 3);
  const Outcome allowed = offstage("validate --quick scene/s.json --allow elsewhere", folder.path());
  EXPECT_EQ(allowed.code, 0) << allowed.err;
}

TEST(SymbolicLink, IsNotFollowedByAnOutput) {
  const TemporaryFolder folder;
  write_file(folder / "victim", "precious");
  fs::create_symlink("victim", folder / "f.png");
  fs::create_symlink("victim", folder / "f.mp4");
  for (const char* command : {"frame -n 1 -o f.png --force ", "render -o f.mp4 --force "}) {
    const Outcome run = offstage(command + tiny_scene() + " -q", folder.path());
    EXPECT_NE(run.code, 0);
    EXPECT_NE(run.err.find("symbolic link"), std::string::npos) << run.err;
  }
  EXPECT_EQ(read_file(folder / "victim"), "precious");
}

TEST(Names, AreEscapedInTablesPagesAndFiles) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", R"text({"name": "../x\" onerror=alert(1)", "bodies": [
    {"name": "a,b\"c\nd", "shape": {"type": "sphere"}, "position": [0, 1, 0]}],
    "render": {"size": [64, 36]}, "output": {
    "duration" : 0.2}
})text");
  ASSERT_EQ(offstage("simulate s.json -q --trace t.csv", folder.path()).code, 0);
  EXPECT_NE(read_file(folder / "t.csv").find("\"a,b\"\"c\nd\""), std::string::npos);
  ASSERT_EQ(offstage("bless s.json --golden sub/golden --reason x", folder.path(), "env -u CI").code, 0);
  for (const auto& [name, bytes] : contents(folder.path()))
    EXPECT_TRUE(name == "s.json" || name == "t.csv" || name.starts_with("sub/golden/")) << name;
}

TEST(ReplacedGoldenPicture, IsNoticed) {
  const TemporaryFolder folder;
  ASSERT_EQ(offstage("bless " + tiny_scene() + " --golden g --reason x", folder.path(), "env -u CI").code, 0);
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(folder / "g"))
    if (entry.path().extension() == ".png") pictures.push_back(entry.path());
  ASSERT_EQ(pictures.size(), 2u);
  fs::copy_file(pictures[0], pictures[1], fs::copy_options::overwrite_existing);
  EXPECT_NE(offstage("compare " + tiny_scene() + " --golden g", folder.path()).code, 0);
}

TEST(FilesOfWrongTypes, AreNamedWithTheKey) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", R"({"output": {"duration": 0.2}, "render": {"size": [64, 36]}})");
  fs::create_directories(folder / "g");
  fs::create_directories(folder / "c");
  fs::create_directories(folder / "d");
  write_file(folder / "g/s.json", R"({"frames": 3})");
  write_file(folder / "c/cache.json", R"({"offstage_cache": "x"})");
  write_file(folder / "d/manifest.json", R"({"settings": 3})");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"compare s.json --golden g", "g/s.json: /frames: must be a list of objects, got 3"},
      {"render s.json --cache c -o o/", "c/cache.json: /offstage_cache: must be a whole number"},
      {"render s.json -o d/", "d/manifest.json: /settings: must be a text, got 3"}};
  for (const auto& [command, message] : cases) {
    const Outcome run = offstage(command, folder.path());
    EXPECT_GT(run.code, 0) << command;
    EXPECT_NE(run.err.find(message), std::string::npos) << run.err;
  }
}

TEST(NumbersBeyondReason, AreRefusedWithTheirPlace) {
  const TemporaryFolder folder;
  for (const char* shape :
       {R"({"type": "sphere", "radius": 1e39})", R"({"type": "cone", "radius": 1e33, "height": 1})",
        R"({"type": "cone", "radius": 1, "height": 1e33})", R"({"type": "box", "size": [1e200, 1, 1]})",
        R"({"type": "mesh", "file": "duck.glb", "scale": 1e100})",
        R"({"type": "mesh", "file": "duck.glb", "scale": 1e39})"}) {
    write_file(folder / "s.json", std::string(R"({"bodies": [{"shape": )") + shape + "}]}");
    const Outcome run = offstage("simulate s.json --duration 0.1 --trace t.csv --force", folder.path());
    EXPECT_EQ(run.code, 3) << shape << run.err;
    EXPECT_TRUE(run.err.starts_with("s.json:1:")) << run.err;
  }
}

TEST(Divergence, KeepsAnEarlierState) {
  const TemporaryFolder folder;
  write_file(folder / "offstage-diverged.json", "mine");
  write_file(folder / "s.json", R"({"world": {"step": 0.1}, "bodies": [{"shape": {"type": "sphere"},
    "velocity": [1e200, 0, 0]}], "output": {"duration": 0.5}})");
  const Outcome run = offstage("simulate s.json", folder.path());
  EXPECT_EQ(run.code, 5) << run.err;
  EXPECT_EQ(read_file(folder / "offstage-diverged.json"), "mine");
  EXPECT_TRUE(fs::exists(folder / "offstage-diverged-2.json"));
}

TEST(ClosedStandardOutput, IsAnErrorWhereResultsGoThere) {
  const TemporaryFolder folder;
  for (const char* command : {"simulate ", "render -o - ", "validate "})
    EXPECT_NE(offstage(command + tiny_scene() + " >&-", folder.path()).code, 0) << command;
}

TEST(ManyProblems, AreListedThenCountedInShortTime) {
  const TemporaryFolder folder;
  std::string text = "{\"version\": 1";
  for (int i = 0; i < 200'000; ++i) text += ",\n\"key_" + std::to_string(i) + "\": 1";
  write_file(folder / "s.json", text + "}");
  const Outcome run = offstage("validate s.json", folder.path(), "timeout -s KILL 60");
  EXPECT_EQ(run.code, 3);
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 51) << run.err.substr(0, 500);
  EXPECT_NE(run.err.find("and 199950 more problems"), std::string::npos);
}

TEST(ManyBodies, AreRefusedBeforeTheyTakeTheMemory) {
  const TemporaryFolder folder;
  write_file(folder / "s.json",
             R"({"bodies": [{"shape": {"type": "sphere"}, "grid": {"count": [100, 100, 10]}},
    {"shape": {"type": "sphere"}, "grid": {"count": [100, 100, 10]}},
    {"shape": {"type": "sphere"}, "grid": {"count": [100, 100, 10]}}]})");
  const Outcome run = offstage("validate s.json", folder.path(), "ulimit -v 6000000; timeout -s KILL 120");
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.err.find("200000"), std::string::npos) << run.err;
}

TEST(StoppedEncoder, DoesNotBlockAnInterruptAndIsNotLeftBehind) {
  const TemporaryFolder folder;
  write_file(folder / "ffmpeg",
             "#!/bin/sh\ncase \"$*\" in *-encoders*) echo ' V....D libx264 x'; exit 0;; esac\n"
             "echo $$ >" +
                 (folder / "encoder").string() + "\nkill -STOP $$\n");
  fs::permissions(folder / "ffmpeg", fs::perms::owner_all);
  setenv("OFFSTAGE_FFMPEG", (folder / "ffmpeg").c_str(), 1);
  Background run({"render", tiny_scene(), "-q", "-o", "f.mp4", "--duration", "5", "--size", "640x360"},
                 folder.path());
  unsetenv("OFFSTAGE_FFMPEG");
  ASSERT_TRUE(appears(folder / "encoder"));
  std::this_thread::sleep_for(std::chrono::seconds(2));
  run.send(SIGTERM);
  EXPECT_EQ(run.end(30), 128 + SIGTERM);
  const int encoder = std::atoi(read_file(folder / "encoder").c_str());
  ASSERT_GT(encoder, 1);
  EXPECT_NE(kill(encoder, 0), 0) << "the encoder still runs";
  EXPECT_FALSE(fs::exists(folder / "f.mp4"));
}

TEST(FailingAllocation, EndsWithOneLineOrGivesTheWholeTable) {
  const TemporaryFolder folder;
  const std::string command = "simulate " + tiny_scene() + " -q --trace t.csv --force";
  ASSERT_EQ(offstage(command, folder.path()).code, 0);
  const std::string whole = read_file(folder / "t.csv");
  const std::string preload = "LD_PRELOAD='" OFFSTAGE_FAILING_MALLOC "' OFFSTAGE_MALLOC_FAILS_AFTER=";
  int failed = 0;
  for (int i = 0; i < tries_of(20); ++i) {
    fs::remove(folder / "t.csv");
    const int after = 4000 + (i * 977) % 14000;  // earlier allocations belong to the start-up of libraries
    const Outcome run = offstage(command, folder.path(), preload + std::to_string(after));
    // The table is complete if the failed allocation was optional, such as a buffer of the C library, or came
    // after the table.
    if (run.code == 0 || fs::exists(folder / "t.csv")) {
      EXPECT_EQ(read_file(folder / "t.csv"), whole) << after;
    }
    if (run.code == 0) continue;
    ++failed;
    EXPECT_EQ(run.code, 1) << after << ": " << run.err;
    EXPECT_EQ(run.err, "offstage: out of memory\n") << after;
  }
  EXPECT_GT(failed, 0);
}

}  // namespace
}  // namespace offstage::test
