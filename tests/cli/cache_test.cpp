// Listing, verifying and clearing caches of snapshots by the command line.

#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace offstage::test {
namespace {

namespace fs = std::filesystem;

class Caches : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome run = offstage("simulate " + tiny_scene() + " --cache caches/one -q", folder_.path());
    ASSERT_EQ(run.code, 0) << run.err;
  }
  Outcome cache(const std::string& arguments) { return offstage("cache " + arguments, folder_.path()); }
  fs::path snapshot(const std::string& name) {
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / "caches/one"))
      if (entry.path().filename() == name) return entry.path();
    return {};
  }
  TemporaryFolder folder_;
};

TEST_F(Caches, AreListedAndVerified) {
  const auto list = nlohmann::json::parse(cache("list caches --json").out);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0]["folder"], "caches/one");
  EXPECT_EQ(list[0]["frames"], 12);
  EXPECT_EQ(list[0]["problem"], "");
  EXPECT_GT(list[0]["bytes"], 1000);
  const Outcome whole = cache("verify caches/one");
  EXPECT_EQ(whole.code, 0);
  EXPECT_EQ(whole.out, "caches/one: 12 frames, all valid\n");
}

TEST_F(Caches, DamageIsFoundInEachFrame) {
  std::string bytes = read_file(snapshot("000005.snap"));
  bytes[bytes.size() / 2] ^= 1;
  write_file(snapshot("000005.snap"), bytes);
  fs::remove(snapshot("000007.snap"));
  const Outcome run = cache("verify caches");
  EXPECT_EQ(run.code, 1);
  EXPECT_NE(run.out.find("000005.snap: damaged snapshot: its checksum is wrong"), std::string::npos)
      << run.out;
  EXPECT_NE(run.out.find("000007.snap"), std::string::npos) << run.out;
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 2) << run.out;
}

TEST_F(Caches, OtherVersionsAreRefusedClearly) {
  const fs::path file = folder_ / "caches/one/cache.json";
  auto json = nlohmann::json::parse(read_file(file));
  const std::string render = "render " + tiny_scene() + " --cache caches/one -o f/####.png -q";
  json["program"] = "0.0.7";
  json["key"] = "of that program";
  write_file(file, json.dump());
  Outcome run = offstage(render, folder_.path());
  EXPECT_EQ(run.code, 1);
  EXPECT_NE(run.err.find("was made by offstage 0.0.7"), std::string::npos) << run.err;

  json["offstage_cache"] = 3;
  write_file(file, json.dump());
  run = offstage(render, folder_.path());
  EXPECT_EQ(run.code, 1);
  EXPECT_NE(run.err.find("another version"), std::string::npos) << run.err;
  EXPECT_NE(cache("list caches").out.find("format 3"), std::string::npos);
  EXPECT_EQ(cache("verify caches").code, 1);
}

TEST_F(Caches, ClearRemovesTheCacheAndNothingElse) {
  write_file(folder_ / "caches/one/notes.txt", "mine");
  const Outcome run = cache("clear caches/one");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(contents(folder_ / "caches").size(), 1u);
  EXPECT_EQ(read_file(folder_ / "caches/one/notes.txt"), "mine");
  EXPECT_EQ(cache("clear caches/one").code, 1) << "the folder is not a cache any more";
  EXPECT_EQ(cache("clear caches").code, 1);
}

}  // namespace
}  // namespace offstage::test
