// Rendering as a user runs it: the same bytes however the work is split, interrupted or resumed, and no
// partial files.

#include <algorithm>
#include <chrono>
#include <set>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/program.h"

namespace offstage::test {
namespace {

namespace fs = std::filesystem;

/// Returns the frames of a render, without the manifest.
std::map<std::string, std::string> frames(const fs::path& folder) {
  auto files = contents(folder);
  files.erase("manifest.json");
  return files;
}

/// Frames of an uninterrupted render, with which the others are compared.
const std::map<std::string, std::string>& reference() {
  static const std::map<std::string, std::string> files = [] {
    const TemporaryFolder folder;
    EXPECT_EQ(offstage("render " + tiny_scene() + " -o out/ -q --threads 1 --jobs 1", folder.path()).code, 0);
    return frames(folder / "out");
  }();
  return files;
}

TEST(Render, SameBytesForAnyNumberOfThreadsAndJobs) {
  ASSERT_EQ(reference().size(), 12u);
  for (const char* threads : {"--threads 2 --jobs 2", "--threads 4 --jobs 3", "--threads 2 --jobs 1"}) {
    const TemporaryFolder folder;
    ASSERT_EQ(offstage(std::string("render ") + tiny_scene() + " -o out/ -q " + threads, folder.path()).code,
              0);
    EXPECT_EQ(frames(folder / "out"), reference()) << threads;
  }
}

TEST(Render, SeveralCamerasGetTheFramesOfTheirOwnRuns) {
  const TemporaryFolder folder;
  const std::string scene =
      tiny_scene() + R"( -q --set 'cameras=[{"name":"top","camera":{"type":"static","eye":[0.1,6,0]}}]' )";
  ASSERT_EQ(offstage("render " + scene + "--camera all -o both/", folder.path()).code, 0);
  EXPECT_EQ(frames(folder / "both/main"), reference()) << "the scene's own camera draws as always";
  ASSERT_EQ(offstage("render " + scene + "--camera top -o top/", folder.path()).code, 0);
  EXPECT_EQ(frames(folder / "both/top"), frames(folder / "top"));
  EXPECT_NE(frames(folder / "top"), reference());
  for (const auto& entry : fs::directory_iterator(folder / "both"))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path() << " is left over";
  const Outcome unknown = offstage("render " + scene + "--camera tops -o c/", folder.path());
  EXPECT_NE(unknown.code, 0);
  EXPECT_NE(unknown.err.find("did you mean 'top'"), std::string::npos) << unknown.err;
}

TEST(Render, JpegAndExrFramesAreResumedLikePng) {
  for (const std::string ending : {"jpg", "exr"}) {
    const TemporaryFolder folder;
    const std::string command =
        "render " + tiny_scene() + " -q --channels depth --channel-format exr -o f/####." + ending;
    ASSERT_EQ(offstage(command, folder.path()).code, 0);
    const auto whole = contents(folder / "f");
    EXPECT_EQ(whole.size(), 25u) << "12 frames, 12 files of channels, and the manifest";
    fs::remove(folder / ("f/0003." + ending));
    fs::resize_file(folder / ("f/0005." + ending), 40);
    ASSERT_EQ(offstage(command + " --resume", folder.path()).code, 0);
    EXPECT_EQ(contents(folder / "f"), whole) << ending;
  }
}

TEST(Render, CacheAndChunksGiveTheSameFrames) {
  const TemporaryFolder folder;
  ASSERT_EQ(offstage("simulate " + tiny_scene() + " --cache cache -q", folder.path()).code, 0);
  for (const char* chunk : {"2/3", "1/3", "3/3"})
    ASSERT_EQ(offstage(std::string("render ") + tiny_scene() + " --cache cache -o out/ -q --chunk " + chunk,
                       folder.path())
                  .code,
              0);
  EXPECT_EQ(frames(folder / "out"), reference());

  // A cache of another scene, and a damaged one, are refused.
  EXPECT_EQ(offstage("render " + tiny_scene() + " --cache cache -o b/ --seed 8", folder.path()).code, 1);
  // The camera may change, because a cache contains only the simulation.
  EXPECT_EQ(
      offstage("render " + tiny_scene() + " --cache cache -o c/ -q --set camera.radius=6", folder.path())
          .code,
      0);
  int damaged = 0;
  for (const auto& [name, content] : contents(folder / "cache"))  // the cache has one published generation
    if (name.ends_with("/000005.snap")) {
      std::string bytes = content;
      bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
      write_file(folder / "cache" / name, bytes);
      ++damaged;
    }
  EXPECT_EQ(damaged, 1);
  const Outcome run = offstage("render " + tiny_scene() + " --cache cache -o d/", folder.path());
  EXPECT_EQ(run.code, 1);
  EXPECT_NE(run.err.find("000005.snap"), std::string::npos) << run.err;
}

TEST(Render, ExistingOutputIsKeptUnlessForced) {
  const TemporaryFolder folder;
  ASSERT_EQ(offstage("render " + tiny_scene() + " -o out/ -q --frames 1-3", folder.path()).code, 0);
  const auto before = contents(folder / "out");
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o out/ --frames 2", folder.path()).code, 2);
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o out/ --frames 4 --seed 3", folder.path()).code, 2)
      << "frames of other settings do not mix";
  EXPECT_EQ(contents(folder / "out"), before);
  EXPECT_EQ(
      offstage("render " + tiny_scene() + " -o out/ -q --frames 2 --seed 3 --force", folder.path()).code, 0);
  EXPECT_EQ(frames(folder / "out").size(), 1u) << "frames of the other settings are gone";
}

/// Runs a render in the background, sends it `signal` once `frames_before` frames exist, and returns its exit
/// code.
int interrupt_render(const TemporaryFolder& folder, const std::string& out, int signal, const fs::path& watch,
                     std::size_t frames_before) {
  const pid_t child = fork();
  if (child == 0) {
    if (chdir(folder.path().c_str()) != 0) _exit(99);
    execl(OFFSTAGE_BINARY_DIR "/offstage", "offstage", "render", tiny_scene().c_str(), "-o", out.c_str(),
          "-q", "--jobs", "1", "--duration", "20", "--set", "bodies.thrown.collides=false", "--resume",
          nullptr);
    _exit(99);
  }
  const auto count = [&] {
    std::error_code ignored;
    std::size_t n = 0;
    for (const auto& entry : fs::directory_iterator(watch, ignored)) n += entry.path().extension() == ".png";
    return n;
  };
  for (int i = 0; i < 3000 && count() < frames_before; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  kill(child, signal);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Render, InterruptedAndResumedGivesTheSameBytesAsOneRun) {
  const TemporaryFolder folder;
  EXPECT_EQ(interrupt_render(folder, "out/", SIGINT, folder / "out", 5), 130);
  const std::size_t first = frames(folder / "out").size();
  EXPECT_EQ(interrupt_render(folder, "out/", SIGTERM, folder / "out", first + 3), 143);
  const auto part = frames(folder / "out");
  ASSERT_GE(part.size(), first + 3);
  ASSERT_LT(part.size(), 480u) << "the run was over before it could be interrupted";
  for (const auto& [name, bytes] : part) EXPECT_TRUE(name.ends_with(".png")) << name;

  // Resumes up to a shorter film, and compares with one uninterrupted run of that film.
  const std::string piece = "render " + tiny_scene() +
                            " -q --duration 20 --set bodies.thrown.collides=false --frames 1-" +
                            std::to_string(part.size() + 4);
  ASSERT_EQ(offstage(piece + " -o out/ --resume", folder.path()).code, 0);
  ASSERT_EQ(offstage(piece + " -o whole/", folder.path()).code, 0);
  EXPECT_EQ(frames(folder / "out"), frames(folder / "whole"));
}

TEST(Render, InterruptedVideoNeverLooksWhole) {
  const TemporaryFolder folder;
  EXPECT_EQ(interrupt_render(folder, "film.mp4", SIGINT, folder / "film.mp4.frames", 5), 130);
  EXPECT_FALSE(fs::exists(folder / "film.mp4"));
  // The resumed video continues from its frames and equals the video of an uninterrupted run.
  const std::string piece =
      "render " + tiny_scene() + " -q --duration 20 --set bodies.thrown.collides=false --frames 1-12";
  ASSERT_EQ(offstage(piece + " -o film.mp4 --resume", folder.path()).code, 0);
  ASSERT_EQ(offstage(piece + " -o whole.mp4", folder.path()).code, 0);
  EXPECT_EQ(read_file(folder / "film.mp4"), read_file(folder / "whole.mp4"));
  EXPECT_FALSE(fs::exists(folder / "film.mp4.frames"));
}

// Particles created before the start of the film are the same in every part of it.
TEST(Render, APrewarmedSceneIsTheSameInChunksFromACacheAndResumed) {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene() + " -q --set emitters.fountain.prewarm=1.1 --set output.start=0.2 ";
  const auto run = [&](const std::string& args) { EXPECT_EQ(offstage(args, folder.path()).code, 0) << args; };
  run("render " + scene + "-o whole/");
  const auto whole = frames(folder / "whole");
  ASSERT_EQ(whole.size(), 12u);
  run("simulate " + scene + "--cache cache");
  for (const char* chunk : {"2/3", "1/3", "3/3"}) {
    run("render " + scene + "-o chunks/ --chunk " + chunk);
    run("render " + scene + "--cache cache -o cached/ --chunk " + chunk);
  }
  EXPECT_EQ(frames(folder / "chunks"), whole);
  EXPECT_EQ(frames(folder / "cached"), whole);
  for (const char* lost : {"0001.png", "0006.png", "0012.png"}) fs::remove(folder / "whole" / lost);
  ASSERT_EQ(frames(folder / "whole").size(), 9u);
  run("render " + scene + "-o whole/ --resume");
  EXPECT_EQ(frames(folder / "whole"), whole);
}

/// `offstage render scene.json --watch` in the background; the destructor ends it.
class WatchedRender {
 public:
  explicit WatchedRender(const fs::path& folder, const std::string& options = "-o out/")
      : log_(folder / "watch.log") {
    const std::string command = "exec " OFFSTAGE_BINARY_DIR "/offstage render scene.json --watch " + options +
                                " > shown.txt 2> watch.log";
    child_ = fork();
    if (child_ != 0) return;
    if (chdir(folder.c_str()) != 0) _exit(99);
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(99);
  }
  ~WatchedRender() { end(); }
  /// Waits until a message has come this number of times.
  bool says(const std::string& message, int times = 1) const {
    const auto count = [&] {
      const std::string log = fs::exists(log_) ? read_file(log_) : "";
      int found = 0;
      for (auto at = log.find(message); at != std::string::npos; at = log.find(message, at + 1)) ++found;
      return found;
    };
    for (int i = 0; i < 6000 && count() < times; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return count() >= times;
  }
  /// Ends the process as Ctrl-C does, and returns its exit code.
  int end() {
    if (child_ <= 0) return -1;
    int status = 0;
    kill(child_, SIGINT);
    waitpid(std::exchange(child_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  const fs::path log_;
  pid_t child_ = -1;
};

/// Returns a falling ball and a jet of particles.
std::string watched_scene(const std::string& color, double height, double duration = 0.3) {
  return R"({"version": 1, "materials": [{"name": "paint", "color": ")" + color +
         R"("}], "bodies": [{"shape": {"type": "sphere"}, "material": "paint", "position": [0, )" +
         std::to_string(height) +
         R"(, 0]}], "emitters": [{"rate": 3000, "overlap": true}],
      "render": {"size": [64, 36], "quality": "preview"}, "output": {"duration": )" +
         std::to_string(duration) + "}}";
}

/// Returns the statistics of a run without its times and its memory.
nlohmann::json lasting_statistics(const fs::path& file) {
  auto stats = nlohmann::json::parse(read_file(file));
  for (const char* key : {"wall_s", "startup_s", "sim_ms", "render_ms", "encode_ms", "peak_rss_mb"})
    stats.erase(key);
  return stats;
}

TEST(Render, WatchWritesTheFilesOfRender) {
  for (const std::string output : {"out/####.png", "film.mp4"}) {
    const TemporaryFolder watched, plain;
    const std::string options = "--channels depth,id --stats stats.json -o " + output;
    write_file(watched / "scene.json", watched_scene("#b03020", 1));
    write_file(plain / "scene.json", watched_scene("#b03020", 1));
    {
      WatchedRender watch(watched.path(), options);
      ASSERT_TRUE(watch.says("rendered in"));
      EXPECT_EQ(watch.end(), 130);
    }
    ASSERT_EQ(offstage("render scene.json -q " + options, plain.path()).code, 0);
    const std::string shown = read_file(watched / "shown.txt");
    EXPECT_EQ(shown, output + "\n");
    EXPECT_EQ(lasting_statistics(watched / "stats.json"), lasting_statistics(plain / "stats.json"));
    const auto files = [](const TemporaryFolder& folder) {
      auto all = contents(folder.path());
      for (const char* name : {"stats.json", "watch.log", "shown.txt"}) all.erase(name);
      return all;
    };
    EXPECT_GT(files(plain).size(), 10u);
    EXPECT_EQ(files(watched), files(plain));
  }
}

TEST(Render, WatchRemovesFramesAndChannelsThatTheNewFilmLacks) {
  const TemporaryFolder folder;
  const auto write_scene = [&](const std::string& output) {
    write_file(folder / "scene.json", R"({"version": 1, "bodies": [{"shape": {"type": "sphere"}}], )"
                                      R"("render": {"size": [64, 36], "quality": "draft"}, "output": )" +
                                          output + "}");
  };
  const auto files = [&] {
    std::set<std::string> names;
    for (const auto& [name, bytes] : contents(folder / "out")) names.insert(name);
    return names;
  };
  const auto comes_to = [&](const std::set<std::string>& expected) {
    for (int i = 0; i < 3000 && files() != expected; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return files() == expected;
  };
  fs::create_directory(folder / "out");
  write_file(folder / "out" / "0003.exr.txt", "of someone else");
  write_scene(R"({"duration": 0.1, "channels": ["depth"]})");
  const WatchedRender watch(folder.path());
  ASSERT_TRUE(comes_to({"0001.exr", "0001.png", "0002.exr", "0002.png", "0003.exr", "0003.exr.txt",
                        "0003.png", "manifest.json"}));
  write_scene(R"({"duration": 0.06, "channels": ["depth"]})");
  EXPECT_TRUE(comes_to({"0001.exr", "0001.png", "0002.exr", "0002.png", "0003.exr.txt", "manifest.json"}))
      << "a shorter film";
  write_scene(R"({"duration": 0.06})");
  EXPECT_TRUE(comes_to({"0001.png", "0002.png", "0003.exr.txt", "manifest.json"}))
      << "a film without channels";
}

TEST(Render, WatchDrawsANewLookFromTheStatesOfTheLastSimulation) {
  const TemporaryFolder folder, other;
  write_file(folder / "scene.json", watched_scene("#b03020", 1));
  WatchedRender watch(folder.path(), "-o out/ --stats stats.json");
  ASSERT_TRUE(watch.says("rendered in"));
  const auto first = nlohmann::json::parse(read_file(folder / "stats.json"));
  write_file(folder / "scene.json", watched_scene("#2030b0", 1));
  ASSERT_TRUE(watch.says("rendered in", 2));
  const auto second = nlohmann::json::parse(read_file(folder / "stats.json"));
  EXPECT_LT(second["sim_ms"]["mean"], first["sim_ms"]["mean"].get<double>() / 10)
      << "the colour does not need a new simulation";
  write_file(other / "scene.json", watched_scene("#2030b0", 1));
  ASSERT_EQ(offstage("render scene.json -o out/ -q --stats stats.json", other.path()).code, 0);
  EXPECT_EQ(frames(folder / "out"), frames(other / "out"));
  EXPECT_EQ(lasting_statistics(folder / "stats.json"), lasting_statistics(other / "stats.json"));
  write_file(folder / "scene.json", watched_scene("#2030b0", 2));
  ASSERT_TRUE(watch.says("rendered in", 3));
  const auto third = nlohmann::json::parse(read_file(folder / "stats.json"));
  EXPECT_NE(third["state_hash"], first["state_hash"]);
  watch.end();
  for (const auto& entry : fs::directory_iterator(folder.path()))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path() << " is left over";
}

TEST(Render, WatchDrawsOneCamera) {
  const TemporaryFolder folder;
  for (const char* cameras : {"all", "near,far"}) {
    const Outcome run = offstage("render " + tiny_scene() + " -o out/ --watch --camera " + cameras,
                                 folder.path(), "timeout 60");
    EXPECT_EQ(run.code, 2) << cameras;
    EXPECT_NE(run.err.find("--watch draws one camera"), std::string::npos) << run.err;
  }
}

TEST(Render, WatchEndsALongFilmWhenTheSceneChanges) {
  const TemporaryFolder folder;
  write_file(folder / "scene.json", watched_scene("#b03020", 1, 3600));
  WatchedRender watch(folder.path());
  const auto has_frame = [&] {
    for (const auto& entry : fs::directory_iterator(folder.path()))
      if (fs::exists(entry.path() / "0003.png")) return true;
    return false;
  };
  for (int i = 0; i < 6000 && !has_frame(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_TRUE(has_frame());
  write_file(folder / "scene.json", watched_scene("#b03020", 1, 0.1));
  ASSERT_TRUE(watch.says("rendered in"));
  EXPECT_EQ(frames(folder / "out").size(), 3u);
  EXPECT_EQ(watch.end(), 130);
}

TEST(Render, WatchKeepsTheLastGoodResultAfterAnError) {
  const TemporaryFolder folder;
  write_file(folder / "scene.json", watched_scene("#b03020", 1));
  WatchedRender watch(folder.path());
  ASSERT_TRUE(watch.says("rendered in"));
  const auto good = contents(folder / "out");
  write_file(folder / "scene.json", R"({"version": 1, "bodies": [)");
  ASSERT_TRUE(watch.says("kept the last good result"));
  EXPECT_TRUE(watch.says("scene.json:1:"));
  EXPECT_EQ(contents(folder / "out"), good);
  write_file(folder / "scene.json", watched_scene("#b03020", 1, 0.1));
  ASSERT_TRUE(watch.says("rendered in", 2));
  EXPECT_EQ(frames(folder / "out").size(), 3u);
}

TEST(Render, FullDiskIsAnErrorAndLeavesNoBrokenFile) {
  const TemporaryFolder folder;
  // A file size limit stands in for the full disk: the write fails in the same way.
  const Outcome run =
      offstage("render " + tiny_scene() + " -o out/ --size 640x360", folder.path(), "ulimit -f 16;");
  EXPECT_EQ(run.code, 1);
  EXPECT_NE(run.err.find(".png"), std::string::npos) << run.err;
  EXPECT_TRUE(frames(folder / "out").empty());
}

TEST(Render, VideoOnAFullDiskIsAnErrorAndLeavesNoFilm) {
  const TemporaryFolder folder;
  const fs::path disk = folder / "disk";
  fs::create_directory(disk);
  if (mount("none", disk.c_str(), "tmpfs", 0, "size=8k") == 0) {
    for (const char* film : {"film.mp4", "film.mov", "film.apng"}) {
      const Outcome run =
          offstage("render " + tiny_scene() + " -q --size 640x360 --duration 1 --seed 9 -o disk/" + film,
                   folder.path());
      EXPECT_EQ(run.code, 1) << film << ": " << run.err;
      EXPECT_TRUE(contents(disk).empty()) << film;
    }
    umount(disk.c_str());
  }
  // Without permission to mount, an encoder script simulates the full disk.
  write_file(folder / "ffmpeg",
             "#!/bin/sh\ncase \"$*\" in *-encoders*) echo ' V....D libx264 x'; exit 0;; esac\n"
             "cat >/dev/null; echo 'No space left on device' >&2; exit 1\n");
  fs::permissions(folder / "ffmpeg", fs::perms::owner_all);
  const Outcome run =
      offstage("render " + tiny_scene() + " -q -o film.mp4", folder.path(), "OFFSTAGE_FFMPEG=./ffmpeg");
  EXPECT_EQ(run.code, 1) << run.err;
  EXPECT_NE(run.err.find("No space left on device"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(folder / "film.mp4"));
}

TEST(Render, InterruptedVideoKeepsAnEarlierFilm) {
  const TemporaryFolder folder;
  write_file(folder / "film.mp4", "an earlier film");
  const Outcome run = offstage("render " + tiny_scene() +
                                   " -q -o film.mp4 --force --duration 30 --jobs 1 "
                                   "--set bodies.thrown.collides=false",
                               folder.path(), "timeout -s INT 2");
  EXPECT_EQ(run.code, 124) << "timeout's own code for a signal it sent";
  EXPECT_EQ(read_file(folder / "film.mp4"), "an earlier film");
}

TEST(Render, TwoPatternsDoNotShareAFolder) {
  const TemporaryFolder folder;
  ASSERT_EQ(offstage("render " + tiny_scene() + " -q --frames 1-2 -o d/a_##.png", folder.path()).code, 0);
  EXPECT_EQ(
      offstage("render " + tiny_scene() + " -q --frames 1-2 --seed 2 -o d/b_##.png", folder.path()).code, 2);
  ASSERT_EQ(
      offstage("render " + tiny_scene() + " -q --frames 1-2 --seed 2 -o d/b_##.png --force", folder.path())
          .code,
      0);
  EXPECT_FALSE(fs::exists(folder / "d/a_01.png")) << "frames of other settings are gone";
}

TEST(Render, AThreadThatCannotBeStartedIsAnErrorNotAHang) {
  const TemporaryFolder folder;
  // The address space is too small for the stack of another thread.
  const Outcome run = offstage("render " + tiny_scene() + " -q -o out/ --jobs 64", folder.path(),
                               "ulimit -v 400000; timeout 60");
  EXPECT_NE(run.code, 0);
  EXPECT_NE(run.code, 124) << "the program hung";
}

TEST(Render, UnwritablePlaceIsAnErrorThatNamesIt) {
  const TemporaryFolder folder;
  const Outcome run = offstage("render " + tiny_scene() + " -o /proc/offstage/####.png", folder.path());
  EXPECT_EQ(run.code, 1);
  EXPECT_NE(run.err.find("/proc/offstage"), std::string::npos) << run.err;
}

TEST(Render, PipeGivesRawFramesTopDown) {
  const TemporaryFolder folder;
  const Outcome run = offstage("render " + tiny_scene() + " -o - --frames 3-4 -q", folder.path());
  EXPECT_EQ(run.out.size(), 2u * 96 * 54 * 4);
  const Outcome y4m =
      offstage("render " + tiny_scene() + " -o - --format y4m --frames 3-4 -q", folder.path());
  EXPECT_EQ(y4m.out.substr(0, 10), "YUV4MPEG2 ");
}

TEST(Render, FrameIsTheSamePictureAsInTheSequence) {
  const TemporaryFolder folder;
  ASSERT_EQ(offstage("frame " + tiny_scene() + " -n 7 -o a.png -q", folder.path()).code, 0);
  EXPECT_EQ(read_file(folder / "a.png"), reference().at("0007.png"));
  ASSERT_EQ(offstage("frame " + tiny_scene() + " --at 0.25 -o b.png -q", folder.path()).code, 0);
  EXPECT_EQ(read_file(folder / "b.png"), read_file(folder / "a.png"));
}

TEST(Render, QualityNeverChangesThePhysics) {
  const TemporaryFolder folder;
  std::map<std::string, std::string> hashes;
  for (const std::string quality : {"draft", "preview", "final"}) {
    ASSERT_EQ(offstage("render " + tiny_scene() + " -o " + quality +
                           "/ -q --frames 12 --force --stats s.json --quality " + quality,
                       folder.path())
                  .code,
              0);
    const std::string stats = read_file(folder / "s.json");
    const auto at = stats.find("\"state_hash\"");
    hashes[stats.substr(at, 60)] = quality;
  }
  EXPECT_EQ(hashes.size(), 1u);
}

/// Returns the compressed pixels of a PNG file, without the settings in front of them, which depend on the
/// channels.
std::string pixel_data(const std::string& png) {
  return png.substr(png.find("IDAT"));
}

TEST(Render, ChannelsAreWrittenBesideTheFrames) {
  const TemporaryFolder folder;
  ASSERT_EQ(
      offstage("render " + tiny_scene() + " -o out/ -q --frames 2-3 --channels depth,id", folder.path()).code,
      0);
  const auto files = frames(folder / "out");
  ASSERT_EQ(files.size(), 4u);
  for (const char* name : {"0002", "0003"}) {
    EXPECT_EQ(pixel_data(files.at(name + std::string(".png"))),
              pixel_data(reference().at(name + std::string(".png"))));
    EXPECT_EQ(files.at(name + std::string(".exr")).substr(0, 4), "\x76\x2f\x31\x01");
    EXPECT_NE(files.at(name + std::string(".exr")).find("2 thrown\n"), std::string::npos);
  }
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o - --channels depth", folder.path()).code, 2);
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o b/ --channels colour", folder.path()).code, 2);
}

TEST(Render, ChannelsAreWrittenInAFolderBesideAVideo) {
  const TemporaryFolder folder;
  const std::string command =
      "render " + tiny_scene() + " -o a.gif -q --frames 1-2 --channels depth,id --channel-format png";
  ASSERT_EQ(offstage(command, folder.path()).code, 0);
  const auto files = frames(folder / "a.channels");
  ASSERT_EQ(files.size(), 4u);
  for (const char* name : {"0001.depth.png", "0001.id.png", "0002.depth.png", "0002.id.png"})
    EXPECT_EQ(files.at(name).substr(1, 3), "PNG") << name;
  EXPECT_NE(files.at("0002.id.png").find(" thrown\n"), std::string::npos);
  std::filesystem::remove(folder / "a.gif");
  EXPECT_EQ(offstage(command, folder.path()).code, 2) << "existing channels are kept";
  EXPECT_EQ(offstage(command + " --force", folder.path()).code, 0);
}

TEST(Render, ChannelsOfAnEarlierFilmDoNotStayBesideAnother) {
  const TemporaryFolder folder;
  const std::string command = "render " + tiny_scene() + " -o a.gif -q ";
  const auto names = [&] {
    std::set<std::string> all;
    for (const auto& [name, bytes] : contents(folder / "a.channels")) all.insert(name);
    return all;
  };
  ASSERT_EQ(offstage(command + "--frames 1-3 --channels depth", folder.path()).code, 0);
  ASSERT_EQ(names(), (std::set<std::string>{"0001.exr", "0002.exr", "0003.exr"}));
  ASSERT_EQ(offstage(command + "--frames 1-2 --channels id --channel-format png --force", folder.path()).code,
            0);
  EXPECT_EQ(names(), (std::set<std::string>{"0001.id.png", "0002.id.png"}))
      << "the channels of the longer film were removed";

  std::filesystem::remove(folder / "a.gif");
  EXPECT_EQ(offstage(command + "--frames 1-2", folder.path()).code, 2) << "existing channels are kept";
  EXPECT_EQ(names().size(), 2u);
  write_file(folder / "a.channels" / "notes.txt", "of someone else");
  ASSERT_EQ(offstage(command + "--frames 1-2 --force", folder.path()).code, 0);
  EXPECT_EQ(names(), std::set<std::string>{"notes.txt"}) << "a film without channels";
}

TEST(Render, ResumeDrawsAFrameAgainThatLacksAChannel) {
  const TemporaryFolder folder;
  const std::string command = "render " + tiny_scene() +
                              " -o out/ -q --frames 1-3 --set 'output.channels=[\"normal\"]' "
                              "--set output.channel_format=png ";
  ASSERT_EQ(offstage(command, folder.path()).code, 0);
  const auto whole = frames(folder / "out");
  ASSERT_EQ(whole.size(), 6u);
  std::filesystem::remove(folder / "out/0002.normal.png");
  std::filesystem::remove(folder / "out/0003.png");
  ASSERT_EQ(offstage(command + "--resume --stats s.json", folder.path()).code, 0);
  EXPECT_EQ(frames(folder / "out"), whole);
  EXPECT_NE(read_file(folder / "s.json").find("\"frames_kept\": 1"), std::string::npos);
}

TEST(Render, TransparentBackgroundHasAlpha) {
  const TemporaryFolder folder;
  ASSERT_EQ(offstage("render " + tiny_scene() +
                         " -o - --frames 1 -q --set environment.background=transparent "
                         "--set bodies.ground.visible=false",
                     folder.path())
                .code,
            0);
  const std::string rgba = offstage("render " + tiny_scene() +
                                        " -o - --frames 1 -q --set environment.background=transparent "
                                        "--set bodies.ground.visible=false",
                                    folder.path())
                               .out;
  ASSERT_EQ(rgba.size(), 96u * 54 * 4);
  std::size_t clear = 0, opaque = 0;
  for (std::size_t i = 3; i < rgba.size(); i += 4) {
    clear += rgba[i] == '\0';
    opaque += rgba[i] == '\xff';
  }
  EXPECT_GT(clear, rgba.size() / 4 / 2);
  EXPECT_GT(opaque, 50u);
  EXPECT_EQ(
      offstage("render " + tiny_scene() + " -o a.mp4 --set environment.background=transparent", folder.path())
          .code,
      2)
      << "mp4 has no alpha";
}

}  // namespace
}  // namespace offstage::test
