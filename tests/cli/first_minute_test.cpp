// The first commands of a new user: `new`, a scene without a command, `encode`, standard input, and the
// estimate.

#include <algorithm>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace offstage::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Returns the frame rate and frame count of a video's first stream as ffprobe prints them: "30000/1001,12".
std::string probe(const fs::path& video) {
  const TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  const std::string command =
      "ffprobe -v error -select_streams v:0 -count_frames -show_entries "
      "stream=r_frame_rate,nb_read_frames -of csv=p=0 '" +
      video.string() + "' >'" + out + "'";
  if (std::system(command.c_str()) != 0) return "unreadable";
  std::string text = read_file(out);
  text.erase(std::remove(text.begin(), text.end(), '\n'), text.end());
  return text;
}

TEST(New, EveryTemplateIsAValidSceneThatRendersAtOnce) {
  const TemporaryFolder folder;
  std::istringstream names(offstage("new --list", folder.path()).out);
  int count = 0;
  for (std::string name, rest; names >> name && std::getline(names, rest); ++count) {
    SCOPED_TRACE(name);
    const Outcome made = offstage("new my_" + name + " --template " + name, folder.path());
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_NE(made.out.find("offstage my_" + name + ".json"), std::string::npos) << made.out;
    const Outcome valid = offstage("validate --no-estimate my_" + name + ".json", folder.path());
    EXPECT_EQ(valid.code, 0) << valid.err;
    EXPECT_EQ(valid.err, "") << "there are no warnings";
    const Outcome drawn = offstage(
        "my_" + name + ".json --size 64x36 --quality draft --frames 1,12 -q -o " + name + "/", folder.path());
    EXPECT_EQ(drawn.code, 0) << drawn.err;
    EXPECT_NE(read_file(folder / (name + "/0001.png")), read_file(folder / (name + "/0012.png")));
  }
  EXPECT_GE(count, 6);
}

TEST(New, NeverReplacesAFileUnaskedAndSuggestsTemplates) {
  const TemporaryFolder folder;
  write_file(folder / "rain.json", "mine");
  EXPECT_EQ(offstage("new rain", folder.path()).code, 2);
  EXPECT_EQ(offstage("new rain.json", folder.path()).code, 2);
  EXPECT_EQ(read_file(folder / "rain.json"), "mine");
  const Outcome slip = offstage("new a --template sprinkle", folder.path());
  EXPECT_EQ(slip.code, 2);
  EXPECT_NE(slip.err.find("did you mean 'sprinkler'?"), std::string::npos) << slip.err;
  EXPECT_NE(slip.err.find("explosion"), std::string::npos) << "the message lists all templates";
  EXPECT_EQ(slip.err.find('\\'), std::string::npos) << "no escaped line breaks: " << slip.err;
  EXPECT_EQ(offstage("new nowhere/a", folder.path()).code, 2);
  EXPECT_EQ(contents(folder.path()).size(), 1u);
  EXPECT_EQ(offstage("new rain --force", folder.path()).code, 0);
  EXPECT_NE(read_file(folder / "rain.json").find("\"preset\": \"rain\""), std::string::npos)
      << "the template with the name of the scene is used";
}

TEST(BareScene, RendersToItsNameInTheCurrentFolder) {
  const TemporaryFolder folder;
  const Outcome run = offstage(tiny_scene() + " --quality draft -q", folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.out, "tiny.mp4\n");
  EXPECT_EQ(probe(folder / "tiny.mp4"), "24/1,12");
  EXPECT_EQ(offstage(tiny_scene(), folder.path()).code, 2) << "existing files are kept, as by render";
  EXPECT_EQ(offstage("--quality draft " + tiny_scene() + " -o a.mkv --frames 1-2", folder.path()).code, 0);
  EXPECT_EQ(probe(folder / "a.mkv"), "24/1,2");
}

TEST(BareScene, AMisspelledCommandGetsItsOwnMessage) {
  const TemporaryFolder folder;
  const Outcome slip = offstage("rendr " + tiny_scene(), folder.path());
  EXPECT_EQ(slip.code, 2);
  EXPECT_NE(slip.err.find("no command 'rendr'; did you mean 'render'?"), std::string::npos) << slip.err;
  write_file(folder / "film.txt", "");
  EXPECT_NE(offstage("film.txt", folder.path()).err.find("film.txt is not a scene"), std::string::npos);
  EXPECT_EQ(offstage("nowhere.json", folder.path()).code, 3);
}

TEST(Output, AFrameNumberInTheNameOfAFolderIsRefused) {
  const TemporaryFolder folder;
  for (const std::string& command :
       {"render " + tiny_scene() + " -o o/####/####.png", "render " + tiny_scene() + " -o o/####/a.mp4",
        "frame " + tiny_scene() + " -o o/####/a.png", "export " + tiny_scene() + " -o o/##/####.ply"}) {
    const Outcome run = offstage(command, folder.path());
    EXPECT_EQ(run.code, 2) << command;
    EXPECT_NE(run.err.find("not in that of its folder"), std::string::npos) << run.err;
  }
  EXPECT_TRUE(contents(folder.path()).empty());
  std::filesystem::create_directory(folder / "take#2");
  EXPECT_EQ(offstage("frame " + tiny_scene() + " -o take#2/a.png -q", folder.path()).code, 0)
      << "an existing folder may have any name";
}

TEST(Output, PatternsOfOtherProgramsGetAHint) {
  const TemporaryFolder folder;
  for (const auto& [given, meant] : {std::pair("f%04d.png", "f####.png"),
                                     {"a/%d.png", "a/#.png"},
                                     {"frames/%03d", "frames/###"},
                                     {"f.\\$F4.png", "f.####.png"},
                                     {"f_{:05}.png", "f_#####.png"}}) {
    const Outcome run = offstage("render " + tiny_scene() + " -o \"" + given + "\"", folder.path());
    EXPECT_EQ(run.code, 2);
    EXPECT_NE(run.err.find(std::string("did you mean '") + meant + "'?"), std::string::npos) << run.err;
  }
  const Outcome encode = offstage("encode f%04d.png -o a.mp4", folder.path());
  EXPECT_EQ(encode.code, 2);
  EXPECT_NE(encode.err.find("did you mean 'f####.png'?"), std::string::npos) << encode.err;
  EXPECT_TRUE(contents(folder.path()).empty());
}

class Encode : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome run =
        offstage("render " + tiny_scene() + " -o f/ --frames 3-7 -q --fps 30000/1001", folder_.path());
    ASSERT_EQ(run.code, 0) << run.err;
  }
  Outcome encode(const std::string& args) { return offstage("encode " + args, folder_.path()); }
  TemporaryFolder folder_;
};

TEST_F(Encode, GivesTheVideoThatTheRenderWouldHaveGiven) {
  ASSERT_EQ(encode("'f/####.png' -o a.mp4 -q").code, 0);
  ASSERT_EQ(
      offstage("render " + tiny_scene() + " -o b.mp4 --frames 3-7 -q --fps 30000/1001", folder_.path()).code,
      0);
  EXPECT_EQ(read_file(folder_ / "a.mp4"), read_file(folder_ / "b.mp4"));
  EXPECT_EQ(probe(folder_ / "a.mp4"), "30000/1001,5") << "the manifest gives the frame rate";
  EXPECT_EQ(encode("f/ -o a.mp4 -q").code, 2) << "the video already exists";
  EXPECT_EQ(encode("f/ -o a.mp4 -q --force --fps 12").code, 0);
  EXPECT_EQ(probe(folder_ / "a.mp4"), "12/1,5");
}

TEST_F(Encode, NamesTheFrameThatIsWrongAndWritesNothing) {
  const auto fails_with = [&](const std::string& args, const std::string& words) {
    const Outcome run = encode(args);
    EXPECT_NE(run.code, 0);
    EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(folder_ / "a.mp4"));
  };
  fs::rename(folder_ / "f/0005.png", folder_ / "0005.png");
  fails_with("'f/####.png' -o a.mp4", "f/0005.png: frame 5 is missing; the frames go from 3 to 7");
  EXPECT_EQ(encode("'f/####.png' -o gaps.mp4 --allow-gaps").code, 0);
  EXPECT_EQ(probe(folder_ / "gaps.mp4"), "30000/1001,4");
  ASSERT_EQ(offstage("frame " + tiny_scene() + " -o f/0005.png --size 64x36 -q", folder_.path()).code, 0);
  fails_with("'f/####.png' -o a.mp4", "f/0005.png: is 64x36, but frame 3 is 96x54");
  const std::string whole = read_file(folder_ / "0005.png");
  write_file(folder_ / "f/0005.png", whole.substr(0, whole.size() / 2));
  fails_with("'f/####.png' -o a.mp4", "f/0005.png: is not a complete PNG file");
  fails_with("'f/###.png' -o a.mp4", "did you mean 'f/####.png'?");
  fails_with("f/0003.png -o a.mp4", "did you mean 'f/####.png'?");
  fails_with("f/*.png -o a.mp4", "in quotes");
  fails_with("f/ -o out/", "encode makes a video");
}

TEST_F(Encode, KeepsTransparencyWhereTheFormatDoesAndSaysWhereNot) {
  ASSERT_EQ(
      offstage("render " + tiny_scene() + " -o t/ --frames 1-2 -q --set environment.background=transparent",
               folder_.path())
          .code,
      0);
  ASSERT_EQ(encode("t/ -o t.apng -q").code, 0);
  ASSERT_EQ(offstage("render " + tiny_scene() +
                         " -o direct.apng --frames 1-2 -q --set "
                         "environment.background=transparent",
                     folder_.path())
                .code,
            0);
  EXPECT_EQ(read_file(folder_ / "t.apng"), read_file(folder_ / "direct.apng"));
  const Outcome opaque = encode("t/ -o t.mp4");
  EXPECT_EQ(opaque.code, 0);
  EXPECT_NE(opaque.err.find("composited over black"), std::string::npos) << opaque.err;
  EXPECT_EQ(encode("f/ -o f.mp4").err.find("composited over black"), std::string::npos)
      << "opaque frames need no note";
}

TEST(StandardInput, IsASceneWhoseFilesLieInTheCurrentFolder) {
  const TemporaryFolder folder;
  const std::string from_tiny = " < '" + tiny_scene() + "'";
  ASSERT_EQ(offstage("frame - -n 2 -o piped.png -q" + from_tiny, folder.path()).code, 0);
  ASSERT_EQ(offstage("frame " + tiny_scene() + " -n 2 -o file.png -q", folder.path()).code, 0);
  EXPECT_EQ(read_file(folder / "piped.png"), read_file(folder / "file.png"));

  write_file(folder / "part.json", R"({"output": {"fps": 10, "duration": 1}})");
  write_file(folder / "s.json", R"({"include": ["part.json"]})");
  EXPECT_NE(offstage("validate --no-estimate - < s.json", folder.path()).out.find("10 frames"),
            std::string::npos);
  write_file(folder / "bad.json", "{\n  \"version\": 1,\n  \"bodys\": []\n}\n");
  const Outcome bad = offstage("validate - < bad.json", folder.path());
  EXPECT_EQ(bad.code, 3);
  EXPECT_NE(bad.err.find("<stdin>:3:3: /bodys"), std::string::npos) << bad.err;
}

TEST(StandardInput, IsRefusedWhereAFileIsNeeded) {
  const TemporaryFolder folder;
  const std::string from_tiny = " < '" + tiny_scene() + "'";
  for (const std::string command :
       {"render - -o a.mp4 --watch", "-", "compare - --golden g", "bless - --reason x --golden g"}) {
    const Outcome run = offstage(command + from_tiny, folder.path(), "env -u CI");
    EXPECT_EQ(run.code, 2) << command << run.err;
    EXPECT_NE(run.err.find("standard input"), std::string::npos) << run.err;
  }
  EXPECT_TRUE(contents(folder.path()).empty());
}

TEST(Estimate, NamesTheMostExpensiveObject) {
  const TemporaryFolder folder;
  write_file(folder / "s.json",
             R"({"version": 1, "bodies": [{"motion": "static", "shape": {"type": "plane"}}],
    "cloths": [{"name": "rag", "shape": {"type": "grid", "cells": [4, 4]}, "position": [0, 2, 0]},
               {"name": "carpet", "shape": {"type": "grid", "size": [3, 3], "cells": [120, 120]}, "position": [0, 1, 0]}],
    "render": {"size": [64, 36], "quality": "draft"}, "output": {"duration": 5}})");
  const Outcome text = offstage("validate s.json", folder.path());
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("s.json: valid, 150 frames"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("most expensive: cloth 'carpet' (14 641 vertices"), std::string::npos) << text.out;
  const json cost = json::parse(offstage("validate s.json --json", folder.path()).out)["cost"];
  EXPECT_EQ(cost["objects"][0]["name"], "carpet");
  EXPECT_GT(cost["simulation_s_per_film_s"], 0);
  EXPECT_GT(cost["drawing_s_per_frame"], 0);
  EXPECT_GT(cost["film_s"], 0);
  EXPECT_LE(cost["trial_film_s"], 5);
  double fractions = 0;
  for (const json& object : cost["objects"]) fractions += object["fraction"].get<double>();
  EXPECT_NEAR(fractions, 1, 1e-3);
  const Outcome quick = offstage("validate s.json --no-estimate --json", folder.path());
  EXPECT_FALSE(json::parse(quick.out).contains("cost"));
}

TEST(Progress, IsSilentOnAPipeAndABarOnRequest) {
  const TemporaryFolder folder;
  ASSERT_EQ(
      offstage("render " + tiny_scene() + " -o a/ --frames 1-3 2>&1 >/dev/null | cat >piped", folder.path())
          .code,
      0);
  EXPECT_EQ(read_file(folder / "piped"), "");
  const Outcome bar =
      offstage("render " + tiny_scene() + " -o b/ --frames 1-3 --progress bar", folder.path());
  ASSERT_EQ(bar.code, 0);
  EXPECT_NE(bar.err.find("]  100 %  frame 3/3"), std::string::npos) << bar.err;
  EXPECT_EQ(std::count(bar.err.begin(), bar.err.end(), '\n'), 1) << "the progress stays on one line";
  std::istringstream states(bar.err);
  for (std::string state; std::getline(states, state, '\r');)
    EXPECT_LT(state.size(), 80u + 4) << "narrower than the terminal, with the control sequence: " << state;
  const Outcome lines =
      offstage("render " + tiny_scene() + " -o c/ --frames 1-3 --progress plain", folder.path());
  EXPECT_EQ(lines.err.find('\r'), std::string::npos);
  EXPECT_NE(lines.err.find("frame 3/3"), std::string::npos);
}

}  // namespace
}  // namespace offstage::test
