// A test of the image tests: a golden must notice a parameter changed by one percent, and a single pixel.

#include <gtest/gtest.h>

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
    EXPECT_NE(run.out.find("it is the renderer"), std::string::npos) << change;
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

}  // namespace
}  // namespace offstage::test
