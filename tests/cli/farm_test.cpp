// The steps of a farm, run by local processes.

#include <cstdlib>

#include <gtest/gtest.h>

#include "cli/program.h"

namespace offstage::test {
namespace {

namespace fs = std::filesystem;

TEST(Farm, LocalProcessesMakeTheSameFilmByteForByte) {
  const TemporaryFolder folder;
  ASSERT_EQ(offstage("render " + tiny_scene() + " -o direct.mp4 -q", folder.path()).code, 0);
  const Outcome run = offstage("farm " + tiny_scene() + " -o farm.mp4 --local 2 --chunks 3", folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(read_file(folder / "farm.mp4"), read_file(folder / "direct.mp4"));

  const Outcome status = offstage("farm --status farm.mp4.farm", folder.path());
  EXPECT_EQ(status.code, 0) << status.out;
  EXPECT_NE(status.out.find("chunks: 3 of 3 done, 12 frames"), std::string::npos) << status.out;
  EXPECT_EQ(offstage("farm " + tiny_scene() + " -o farm.mp4 --local 2", folder.path()).code, 2)
      << "the farm already exists";
}

TEST(Farm, AFailedChunkIsTriedAgainAndResumed) {
  const TemporaryFolder folder;
  // A program that fails the first two times it draws the second chunk.
  write_file(folder / "flaky.sh",
             "#!/bin/sh\ncase \"$*\" in *' 2/3'*)\n  echo x >>tries\n"
             "  [ $(wc -l <tries) -gt 2 ] || exit 1 ;;\nesac\nexec " OFFSTAGE_BINARY_DIR
             "/offstage \"$@\"\n");
  fs::permissions(folder / "flaky.sh", fs::perms::owner_all);
  const std::string farm = "farm " + tiny_scene() + " -o out/####.png --local 1 --chunks 3 --program " +
                           (folder / "flaky.sh").string() + " --retries ";
  const Outcome failed = offstage(farm + "0", folder.path());
  EXPECT_EQ(failed.code, 1);
  EXPECT_NE(failed.err.find("1 of 3 chunks failed"), std::string::npos) << failed.err;
  EXPECT_NE(offstage("farm --status out.farm", folder.path()).out.find("chunks: 2 of 3 done, 8 frames"),
            std::string::npos);
  const Outcome resumed = offstage(farm + "1 --resume", folder.path());
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(read_file(folder / "out.farm/tries"), "x\nx\nx\n");
  ASSERT_EQ(offstage("render " + tiny_scene() + " -o direct/####.png -q", folder.path()).code, 0);
  for (const auto& [name, bytes] : contents(folder / "direct")) {
    if (!name.ends_with(".png")) continue;
    EXPECT_EQ(read_file(folder / "out" / name), bytes) << name;
  }
}

TEST(Farm, AChangedSceneIsNotMixedIn) {
  const TemporaryFolder folder;
  const std::string farm = "farm " + tiny_scene() + " -o f/####.png --local 2 --chunks 2 -q";
  ASSERT_EQ(offstage(farm, folder.path()).code, 0);
  const Outcome other = offstage(farm + " --resume --seed 8", folder.path());
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.err.find("another scene"), std::string::npos) << other.err;
}

TEST(Farm, ADryRunPrintsScriptsThatAShellReads) {
  const TemporaryFolder folder;
  const Outcome run = offstage("farm " + tiny_scene() +
                                   " -o \"my film.mp4\" --slurm --chunks 4 --partition fast "
                                   "--sbatch=--mem=8G --threads 3 --set \"world.gravity=[0,-9,0]\" --dry-run",
                               folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(contents(folder.path()).empty() || !fs::exists(folder / "my film.mp4.farm"));
  write_file(folder / "all.sh", run.out);
  EXPECT_EQ(std::system(("sh -n " + (folder / "all.sh").string()).c_str()), 0);
  for (const char* text :
       {"--array=1,2,3,4", "--dependency=afterok:$simulate", "--dependency=afterok:$chunks",
        "--partition=fast", "--mem=8G", "--cpus-per-task=3", "'world.gravity=[0,-9,0]'",
        "--chunk \"$chunk/4\"", "--requeue"})
    EXPECT_NE(run.out.find(text), std::string::npos) << text << "\n" << run.out;
}

TEST(Farm, NeedsLocalOrSlurm) {
  const TemporaryFolder folder;
  EXPECT_EQ(offstage("farm " + tiny_scene() + " -o f.mp4", folder.path()).code, 2);
  EXPECT_EQ(offstage("farm " + tiny_scene() + " -o f.mp4 --slurm --local 2", folder.path()).code, 2);
  EXPECT_EQ(offstage("farm --status nowhere", folder.path()).code, 1);
  const Outcome no_sbatch =
      offstage("farm " + tiny_scene() + " -o f.mp4 --slurm", folder.path(), "PATH=/nowhere");
  EXPECT_EQ(no_sbatch.code, 4) << no_sbatch.err;
}

}  // namespace
}  // namespace offstage::test
