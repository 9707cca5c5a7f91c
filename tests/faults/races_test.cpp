// Concurrent runs with the same output, and runs that are killed: frames of two films are never mixed.

#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "cli/program.h"
#include "faults/background.h"
#include "faults/injection_count.h"

namespace offstage::test {
namespace {

namespace fs = std::filesystem;

const std::string kOptions = " -q --size 160x90 --duration 1 --quality draft --threads 2";
const std::vector<std::string> kArguments = {"-q",        "--size", "160x90",    "--duration", "1",
                                             "--quality", "draft",  "--threads", "2"};

std::vector<std::string> with_options(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), kArguments.begin(), kArguments.end());
  return arguments;
}

/// Returns the PNG files of a folder by name.
std::map<std::string, std::string> frames_of(const fs::path& folder) {
  std::map<std::string, std::string> frames = contents(folder);
  std::erase_if(frames, [](const auto& file) { return !file.first.ends_with(".png"); });
  return frames;
}

/// Returns the frames of the complete film for a seed. Each film is drawn only once.
const std::map<std::string, std::string>& film_of_seed(int seed) {
  static std::map<int, std::map<std::string, std::string>> known;
  if (const auto film = known.find(seed); film != known.end()) return film->second;
  const TemporaryFolder folder;
  EXPECT_EQ(offstage("render " + tiny_scene() + kOptions + " --seed " + std::to_string(seed) + " -o f/",
                     folder.path())
                .code,
            0);
  return known[seed] = frames_of(folder / "f");
}

TEST(TwoRuns, TheSecondIsRefusedWithTheNameOfTheFirst) {
  const TemporaryFolder folder;
  Background first(with_options({"render", tiny_scene(), "--seed", "7", "-o", "d/"}), folder.path());
  ASSERT_TRUE(appears(folder / "d/0002.png"));
  first.send(SIGSTOP);
  const Outcome second = offstage("render " + tiny_scene() + kOptions + " -o d/ --force", folder.path());
  EXPECT_EQ(second.code, 2);
  EXPECT_NE(second.err.find("process " + std::to_string(first.pid())), std::string::npos) << second.err;
  first.send(SIGCONT);
  EXPECT_EQ(first.end(), 0);
  EXPECT_EQ(frames_of(folder / "d"), film_of_seed(7));
  EXPECT_EQ(offstage("render " + tiny_scene() + kOptions + " -o d/ --force", folder.path()).code, 0)
      << "the lock ends with the process that holds it";
}

TEST(TwoRuns, PartsOfOneFilmShareAFolder) {
  const TemporaryFolder folder;
  std::vector<std::unique_ptr<Background>> parts;
  for (const char* part : {"1/3", "2/3", "3/3"})
    parts.push_back(std::make_unique<Background>(
        with_options({"render", tiny_scene(), "--seed", "7", "-o", "d/", "--chunk", part}), folder.path()));
  for (const auto& part : parts) EXPECT_EQ(part->end(), 0);
  EXPECT_EQ(frames_of(folder / "d"), film_of_seed(7));
}

TEST(KilledRun, ForcedOverForeignFramesAndResumedHasItsOwnFramesOnly) {
  const auto& expected = film_of_seed(7);
  std::mt19937 random(1);
  for (int i = 0; i < tries_of(2); ++i) {
    const TemporaryFolder folder;
    ASSERT_EQ(offstage("render " + tiny_scene() + kOptions + " --seed 3 -o d/", folder.path()).code, 0);
    fs::remove(folder / "d/manifest.json");
    const bool has_begun = i % 2 == 0;
    {
      const Background killed(with_options({"render", tiny_scene(), "--seed", "7", "-o", "d/", "--force"}),
                              folder.path());
      if (has_begun) {
        ASSERT_TRUE(appears(folder / "d/manifest.json"));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % 800));
    }
    const Outcome resumed =
        offstage("render " + tiny_scene() + kOptions + " --seed 7 -o d/ --resume", folder.path());
    if (!has_begun && resumed.code == 2)
      // the run was killed before it wrote anything: the frames belong to another film, and the message says
      // so
      continue;
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_EQ(frames_of(folder / "d"), expected);
  }
}

TEST(KilledRun, LeavesNothingThatTheNextRunDoesNotRemove) {
  std::mt19937 random(2);
  for (int i = 0; i < tries_of(2); ++i) {
    const std::string film = i % 2 == 0 ? "film.mp4" : "film.gif";
    const TemporaryFolder folder;
    {
      const Background killed(with_options({"render", tiny_scene(), "-o", film}), folder.path());
      std::this_thread::sleep_for(std::chrono::milliseconds(200 + random() % 1500));
    }
    EXPECT_EQ(offstage("render " + tiny_scene() + kOptions + " --force -o " + film, folder.path()).code, 0);
    std::set<std::string> names;
    for (const auto& [name, bytes] : contents(folder.path()))
      if (!name.starts_with("own-cache")) names.insert(name);
    EXPECT_EQ(names, std::set<std::string>{film});
  }
}

TEST(ResumedVideo, RemovesOnlyFilesThatItWrote) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "v.mp4.frames");
  write_file(folder / "v.mp4.frames/mine.txt", "precious");
  ASSERT_EQ(offstage("render " + tiny_scene() + kOptions + " -o v.mp4 --resume", folder.path()).code, 0);
  EXPECT_EQ(contents(folder / "v.mp4.frames"),
            (std::map<std::string, std::string>{{"mine.txt", "precious"}}));
}

TEST(ResumedFrames, DoNotOverwriteAStrangersFile) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "d");
  write_file(folder / "d/0001.png", "not of a film");
  const Outcome run = offstage("render " + tiny_scene() + kOptions + " -o d/ --resume", folder.path());
  EXPECT_EQ(run.code, 2);
  EXPECT_EQ(read_file(folder / "d/0001.png"), "not of a film");
}

TEST(PartOfAVideo, IsRefused) {
  const TemporaryFolder folder;
  const Outcome run = offstage("render " + tiny_scene() + kOptions + " -o v.mp4 --chunk 1/2", folder.path());
  EXPECT_EQ(run.code, 2);
  EXPECT_NE(run.err.find("encode"), std::string::npos) << run.err;
}

TEST(CacheOfSnapshots, RewrittenUnderItsReaderGivesOneSimulation) {
  const auto& expected = film_of_seed(7);
  for (int i = 0; i < tries_of(1); ++i) {
    const TemporaryFolder folder;
    ASSERT_EQ(
        offstage("simulate " + tiny_scene() + " -q --duration 1 --seed 7 --cache c", folder.path()).code, 0);
    Background reader(with_options({"render", tiny_scene(), "--seed", "7", "--cache", "c", "-o", "d/"}),
                      folder.path());
    ASSERT_TRUE(appears(folder / "d/0002.png"));
    EXPECT_EQ(
        offstage("simulate " + tiny_scene() + " -q --duration 1 --seed 1 --cache c --force", folder.path())
            .code,
        0);
    EXPECT_EQ(reader.end(), 0);
    EXPECT_EQ(frames_of(folder / "d"), expected);
    EXPECT_NE(offstage("render " + tiny_scene() + kOptions + " --seed 7 --cache c -o e/", folder.path()).code,
              0)
        << "the cache now belongs to another simulation";
  }
}

TEST(CacheOfSnapshots, WithASnapshotOfAnotherSimulationIsRefused) {
  const TemporaryFolder folder;
  for (const std::string seed : {"1", "7"})
    ASSERT_EQ(offstage("simulate " + tiny_scene() + " -q --duration 1 --seed " + seed + " --cache c" + seed,
                       folder.path())
                  .code,
              0);
  const auto snapshot = [&](const std::string& cache) {
    for (const auto& entry : fs::directory_iterator(folder / cache))
      if (entry.is_directory()) return entry.path() / "000003.snap";
    return fs::path();
  };
  fs::copy_file(snapshot("c1"), snapshot("c7"), fs::copy_options::overwrite_existing);
  const Outcome run =
      offstage("render " + tiny_scene() + kOptions + " --seed 7 --cache c7 -o d/", folder.path());
  EXPECT_EQ(run.code, 1);
  EXPECT_NE(run.err.find("000003.snap"), std::string::npos) << run.err;
}

TEST(CacheOfSnapshots, OfAKilledRunIsUnfinishedAndGoesWithTheNext) {
  const TemporaryFolder folder;
  {
    const Background killed({"simulate", tiny_scene(), "-q", "--duration", "60", "--cache", "c"},
                            folder.path());
    ASSERT_TRUE(appears(folder / "c"));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  EXPECT_EQ(offstage("render " + tiny_scene() + kOptions + " --cache c -o d/", folder.path()).code, 1);
  ASSERT_EQ(offstage("simulate " + tiny_scene() + " -q --duration 1 --cache c", folder.path()).code, 0);
  int generations = 0;
  for (const auto& entry : fs::directory_iterator(folder / "c")) generations += entry.is_directory();
  EXPECT_EQ(generations, 1);
}

}  // namespace
}  // namespace offstage::test
