// A test of the image tests: a golden must notice a parameter changed by one percent, and a single pixel.

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace offstage::test {
namespace {

constexpr const char* kScene = OFFSTAGE_SOURCE_DIR "/tests/data/tiny.json";

class Golden : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome run =
        offstage(std::string("bless ") + kScene + " --golden g --reason test", folder_.path(), "env -u CI");
    ASSERT_EQ(run.code, 0) << run.err;
  }
  Outcome compare(const std::string& more) {
    return offstage(std::string("compare ") + kScene + " --golden g --report report " + more, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(Golden, UnchangedSceneIsIdentical) {
  const Outcome run = compare("");
  EXPECT_EQ(run.code, 0) << run.out;
  EXPECT_NE(run.out.find("identical"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "report"));
}

TEST_F(Golden, StatesKeptByOneComparisonAreDrawnByAnother) {
  ASSERT_EQ(compare("--keep-states kept").code, 0);
  const Outcome run = compare("--states kept");
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_NE(run.out.find("identical"), std::string::npos);
  EXPECT_EQ(compare("--states kept --set world.gravity=[0,-9.9081,0]").code, 1)
      << "those of another simulation";
}

TEST_F(Golden, OnePercentOfAPhysicalParameterIsAChangeOfTheSimulation) {
  for (const char* change : {"--set world.gravity=[0,-9.9081,0]", "--set emitters.0.speed.mean=3.03",
                             "--set springs.0.stiffness=40.4", "--set particles.0.mass=0.505",
                             "--set bodies.1.angular_velocity=[1.01,2,3]", "--seed 8"}) {
    const Outcome run = compare(change);
    EXPECT_EQ(run.code, 6) << change << "\n" << run.out;
    EXPECT_NE(run.out.find("state differs"), std::string::npos) << change;
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "report/index.html"));
}

TEST_F(Golden, OnePercentOfALookIsAChangeOfTheRenderer) {
  for (const char* change :
       {"--set camera.radius=5.05", "--set lights=[{\"intensity\":3.03}]", "--set render.exposure=1.01"}) {
    const Outcome run = compare("\"" + std::string(change).replace(5, 1, "\" '") + "'");
    EXPECT_EQ(run.code, 6) << change << "\n" << run.out << run.err;
    EXPECT_NE(run.out.find("the renderer differs"), std::string::npos) << change;
  }
}

TEST_F(Golden, MissingGoldenAndEmptyReasonAreErrors) {
  EXPECT_EQ(offstage(std::string("compare ") + kScene + " --golden nowhere", folder_.path()).code, 1);
  EXPECT_EQ(
      offstage(std::string("bless ") + kScene + " --golden g --reason ' '", folder_.path(), "env -u CI").code,
      2);
  EXPECT_EQ(
      offstage(std::string("bless ") + kScene + " --golden g --reason why", folder_.path(), "CI=true").code,
      2)
      << "never in CI";
}

TEST_F(Golden, PicturesCompareByPixels) {
  const std::string frame = std::string("frame ") + kScene + " -q ";
  ASSERT_EQ(offstage(frame + "-n 2 -o a.png", folder_.path()).code, 0);
  ASSERT_EQ(offstage(frame + "-n 2 -o b.png", folder_.path()).code, 0);
  ASSERT_EQ(offstage(frame + "-n 3 -o c.png", folder_.path()).code, 0);
  EXPECT_EQ(offstage("compare a.png b.png", folder_.path()).code, 0);
  EXPECT_EQ(offstage("compare a.png c.png", folder_.path()).code, 6);
}

/// A scene that falls at its own pace, 64 x 36 pixels.
std::string falling_ball(double speed) {
  return R"({"version": 1, "bodies": [{"shape": {"type": "sphere"}, "velocity": [0, )" +
         std::to_string(speed) +
         R"(, 0]}], "render": {"size": [64, 36], "quality": "draft"}, "output": {"fps": 10, "duration": 0.6}})";
}

TEST(GoldenNames, ScenesOfOneNameInDifferentFoldersHaveGoldensOfTheirOwn) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "sub");
  write_file(folder / "rain.json", falling_ball(1));
  write_file(folder / "sub/rain.json", falling_ball(2));
  const std::string in = "env -u CI";
  const Outcome bless = offstage("bless rain.json sub/rain.json --golden g --reason new", folder.path(), in);
  ASSERT_EQ(bless.code, 0) << bless.err;
  EXPECT_NE(bless.out.find("sub-rain: 2 frames (of sub/rain.json)"), std::string::npos) << bless.out;
  for (const char* scene : {"rain.json", "sub/rain.json", "./sub/../rain.json"})
    EXPECT_EQ(offstage(std::string("compare ") + scene + " --golden g", folder.path()).code, 0) << scene;

  // One alone must not be taken for the other.
  EXPECT_EQ(offstage("bless sub/rain.json --golden h --reason new", folder.path(), in).code, 0);
  const Outcome other = offstage("compare rain.json --golden h", folder.path());
  EXPECT_EQ(other.code, 1);
  EXPECT_NE(other.err.find("no golden for rain.json"), std::string::npos) << other.err;

  // A scene that moved keeps its golden, and says so.
  std::filesystem::create_directories(folder / "new");
  std::filesystem::rename(folder / "sub/rain.json", folder / "new/rain.json");
  const Outcome moved = offstage("compare new/rain.json --golden h", folder.path());
  EXPECT_EQ(moved.code, 0) << moved.err;
  EXPECT_NE(moved.err.find("no longer exists"), std::string::npos) << moved.err;
}

TEST(GoldenNames, AGoldenWithoutASourceServesTheSceneOfItsName) {
  const TemporaryFolder folder;
  write_file(folder / "rain.json", falling_ball(1));
  ASSERT_EQ(offstage("bless rain.json --golden g --reason new", folder.path(), "env -u CI").code, 0);
  auto golden = nlohmann::json::parse(read_file(folder / "g/rain.json"));
  EXPECT_EQ(golden["source"], "../rain.json");
  golden.erase("source");
  write_file(folder / "g/rain.json", golden.dump());
  EXPECT_EQ(offstage("compare rain.json --golden g", folder.path()).code, 0);
}

}  // namespace
}  // namespace offstage::test
