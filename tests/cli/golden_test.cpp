// Goldens must detect a parameter that changed by one per cent, and a single changed pixel.

#include <cstdlib>
#include <set>

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

TEST_F(Golden, RecordsTheFramesThatAreAskedFor) {
  const auto bless = [&](const std::string& more) {
    return offstage(std::string("bless ") + kScene + " --golden g --reason test " + more, folder_.path(),
                    "env -u CI");
  };
  const auto pictures = [&] {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "g"))
      if (entry.path().extension() == ".png") names.insert(entry.path().filename().string());
    return names;
  };
  ASSERT_EQ(bless("--frames 3,2").code, 0);
  const std::set<std::string> expected = {"tiny-0002.png", "tiny-0003.png"};
  EXPECT_EQ(pictures(), expected);
  ASSERT_EQ(bless("").code, 0);
  EXPECT_EQ(pictures(), expected) << "the golden keeps its frames";
  EXPECT_EQ(compare("").code, 0);
  EXPECT_EQ(compare("--set output.duration=0.1").code, 6) << "a frame is missing";
  EXPECT_EQ(bless("--frames 1000").code, 2);
}

TEST_F(Golden, StatesKeptByOneComparisonAreDrawnByAnother) {
  ASSERT_EQ(compare("--keep-states kept").code, 0);
  const Outcome run = compare("--states kept");
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_NE(run.out.find("identical"), std::string::npos);
  EXPECT_EQ(compare("--states kept --set world.gravity=[0,-9.9081,0]").code, 1)
      << "the states belong to another simulation";
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
      << "bless does not run in CI";
}

TEST_F(Golden, PicturesCompareByPixels) {
  const std::string frame = std::string("frame ") + kScene + " -q ";
  ASSERT_EQ(offstage(frame + "-n 2 -o a.png", folder_.path()).code, 0);
  ASSERT_EQ(offstage(frame + "-n 2 -o b.png", folder_.path()).code, 0);
  ASSERT_EQ(offstage(frame + "-n 3 -o c.png", folder_.path()).code, 0);
  EXPECT_EQ(offstage("compare a.png b.png", folder_.path()).code, 0);
  EXPECT_EQ(offstage("compare a.png c.png", folder_.path()).code, 6);
}

/// Returns a scene with a ball whose initial vertical speed is `speed`, 64 x 36 pixels.
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

  // If only one of two scenes with the same name has a golden, the golden must not be used for the other
  // scene.
  EXPECT_EQ(offstage("bless sub/rain.json --golden h --reason new", folder.path(), in).code, 0);
  const Outcome other = offstage("compare rain.json --golden h", folder.path());
  EXPECT_EQ(other.code, 1);
  EXPECT_NE(other.err.find("no golden for rain.json"), std::string::npos) << other.err;

  // A scene that was moved to another folder keeps its golden, and a message says so.
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

/// Reads a JUnit file by Python's XML parser: "NAME OUTCOME KIND" of each test, then the counts.
std::string read_junit(const std::filesystem::path& file) {
  const std::filesystem::path script = file.parent_path() / "read_junit.py", out = script.string() + ".out";
  write_file(script, R"(
import sys, xml.etree.ElementTree as xml
suite = xml.parse(sys.argv[1]).getroot().find("testsuite")
for case in suite.findall("testcase"):
    problem = case.find("failure") if case.find("failure") is not None else case.find("error")
    float(case.get("time"))
    print(case.get("name"), "passed" if problem is None else problem.tag + " " + problem.get("type"))
print(suite.get("tests"), suite.get("failures"), suite.get("errors"))
)");
  const std::string command =
      "/usr/bin/python3 " + script.string() + " " + file.string() + " >" + out.string() + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return read_file(out);
}

TEST(GoldenSuites, ManyScenesGiveOneVerdictOneReportAndOneJunitFile) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "scenes");
  write_file(folder / "scenes/slow.json", falling_ball(1));
  write_file(folder / "scenes/fast & odd.json", falling_ball(2));
  write_file(folder / "scenes/broken.json", falling_ball(3));
  ASSERT_EQ(offstage("bless scenes/*.json --golden goldens --reason new", folder.path(), "env -u CI").code,
            0);
  const std::string compare = "compare scenes/*.json --golden goldens --junit results.xml --report report";
  const Outcome same = offstage(compare, folder.path());
  EXPECT_EQ(same.code, 0) << same.out << same.err;
  EXPECT_EQ(read_junit(folder / "results.xml"),
            "scenes/broken.json passed\nscenes/fast & odd.json passed\nscenes/slow.json passed\n3 0 0\n");

  // A changed scene gives a difference image and exit code 6.
  write_file(folder / "scenes/fast & odd.json", falling_ball(2.02));
  const Outcome changed = offstage(compare, folder.path());
  EXPECT_EQ(changed.code, 6) << changed.err;
  EXPECT_NE(changed.out.find("3 scenes: 2 as recorded, 1 with differences, 0 with errors"), std::string::npos)
      << changed.out;
  EXPECT_EQ(read_junit(folder / "results.xml"),
            "scenes/broken.json passed\nscenes/fast & odd.json failure images differ\n"
            "scenes/slow.json passed\n3 1 0\n");
  const std::string page = read_file(folder / "report/index.html");
  EXPECT_NE(page.find("href=\"fast___odd/index.html\""), std::string::npos) << page;
  EXPECT_TRUE(std::filesystem::exists(folder / "report/fast___odd/fast___odd-0001-difference.png"));

  // A scene that cannot be read does not prevent the comparison of the others; an error decides the exit
  // code.
  write_file(folder / "scenes/broken.json", "{\"version\": 1, \"bodis\": []}");
  const Outcome broken = offstage(compare, folder.path());
  EXPECT_EQ(broken.code, 3) << broken.err;
  EXPECT_NE(broken.err.find("bodis"), std::string::npos) << broken.err;
  EXPECT_EQ(read_junit(folder / "results.xml"),
            "scenes/broken.json error scene invalid\nscenes/fast & odd.json failure images differ\n"
            "scenes/slow.json passed\n3 1 1\n");
}

TEST(GoldenSuites, StatesOfManyScenesAreDrawnAgain) {
  const TemporaryFolder folder;
  write_file(folder / "a.json", falling_ball(1));
  write_file(folder / "b.json", falling_ball(2));
  ASSERT_EQ(offstage("bless a.json b.json --golden g --reason new", folder.path(), "env -u CI").code, 0);
  EXPECT_EQ(offstage("compare a.json b.json --golden g --keep-states kept", folder.path()).code, 0);
  EXPECT_EQ(offstage("compare a.json b.json --golden g --states kept", folder.path()).code, 0);
}

TEST(GoldenSuites, ConvexPartsAreStoredBesideTheStates) {
  const TemporaryFolder folder;
  write_file(folder / "wedge.obj",
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  write_file(folder / "a.json",
             R"({"version": 1, "output": {"duration": 0.2}, "render": {"size": [32, 32]},
                 "bodies": [{"motion": "static", "shape": {"type": "plane"}},
                            {"shape": {"type": "mesh", "file": "wedge.obj"}, "position": [0, 2, 0]}]})");
  ASSERT_EQ(offstage("bless a.json --golden g --reason new", folder.path(), "env -u CI").code, 0);
  for (int round = 0; round < 2; ++round) {
    const Outcome run = offstage("compare a.json --golden g --keep-states kept", folder.path());
    EXPECT_EQ(run.code, 0) << run.out << run.err;
    EXPECT_FALSE(std::filesystem::is_empty(folder / "kept/parts"));
    EXPECT_EQ(offstage("compare a.json --golden g --states kept", folder.path()).code, 0);
  }
}

TEST(GoldenSuites, ScenesAndPicturesDoNotMix) {
  const TemporaryFolder folder;
  write_file(folder / "a.json", falling_ball(1));
  EXPECT_EQ(offstage("compare a.json picture.png --golden g", folder.path()).code, 2);
  EXPECT_EQ(offstage("compare one.png two.png three.png", folder.path()).code, 2);
  EXPECT_EQ(offstage("compare one.png two.png --junit out.xml", folder.path()).code, 2);
}

}  // namespace
}  // namespace offstage::test
