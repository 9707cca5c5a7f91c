// The commands as a user sees them: exit codes, messages, and which files are written.

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace offstage::test {
namespace {

using nlohmann::json;

TEST(Commands, ValidSceneIsCalledValid) {
  const TemporaryFolder folder;
  const Outcome run = offstage("validate " + tiny_scene(), folder.path());
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_NE(run.out.find("valid, 12 frames"), std::string::npos) << run.out;
}

TEST(Commands, PresetsNameEffectsFabricsAndArticulations) {
  const TemporaryFolder folder;
  const Outcome all = offstage("presets", folder.path());
  for (const std::string name : {"rain ", "denim ", "ragdoll ", "crane "})
    EXPECT_NE(all.out.find("\n" + name), std::string::npos) << name;
  // The printed JSON of a preset is valid in a scene.
  const Outcome crane = offstage("presets crane", folder.path());
  ASSERT_EQ(crane.code, 0) << crane.err;
  EXPECT_EQ(json::parse(crane.out).at("reach"), 6);
  write_file(folder / "s.json", R"({"version": 1, "articulations": [)" + crane.out + "]}");
  EXPECT_EQ(offstage("validate s.json", folder.path()).code, 0);
}

TEST(Commands, EveryProblemOfASceneIsReportedWithItsPlaceAndExit3) {
  const TemporaryFolder folder;
  write_file(folder / "bad.json",
             "{\n  \"version\": 1,\n  \"bodies\": [\n    {\"shape\": {\"type\": \"sphere\", \"radius\": -1}, "
             "\"masss\": 2}\n  ]\n}\n");
  for (const std::string command :
       {"validate bad.json", "render bad.json -o out/####.png", "simulate bad.json"}) {
    const Outcome run = offstage(command, folder.path());
    EXPECT_EQ(run.code, 3) << command;
    EXPECT_NE(run.err.find("bad.json:4:"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("/bodies/0/shape/radius"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("masss"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("mass"), std::string::npos) << run.err;
  }
  EXPECT_EQ(contents(folder.path()).size(), 1u) << "nothing is written for an invalid scene";
}

TEST(Commands, MissingSceneOrModelIsExit3) {
  const TemporaryFolder folder;
  EXPECT_EQ(offstage("validate nowhere.json", folder.path()).code, 3);
  write_file(
      folder / "s.json",
      R"({"version": 1, "bodies": [{"motion": "static", "shape": {"type": "mesh", "file": "no.obj"}}]})");
  const Outcome run = offstage("validate s.json", folder.path());
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.err.find("no.obj"), std::string::npos) << run.err;
}

TEST(Commands, OpenMeshAsDynamicBodyIsRefusedByValidate) {
  const TemporaryFolder folder;
  write_file(folder / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_file(
      folder / "s.json",
      R"({"version": 1, "bodies": [{"name": "sail", "shape": {"type": "mesh", "file": "open.obj"}}]})");
  const Outcome run = offstage("validate s.json", folder.path());
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.err.find("/bodies/0"), std::string::npos) << run.err;
}

TEST(Commands, ValidateWarnsOfBodiesThatBeginInEachOther) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", R"({"version": 1, "bodies": [
    {"name": "floor", "motion": "static", "shape": {"type": "box", "size": [9, 1, 9]}, "position": [0, -0.5, 0]},
    {"name": "rests", "position": [0, 0.5, 0], "shape": {"type": "box", "size": [1, 1, 1]}},
    {"name": "sunk", "position": [3, 0.49, 0], "shape": {"type": "box", "size": [1, 1, 1]}},
    {"name": "ghost", "position": [3, 0.5, 0], "collides": false, "shape": {"type": "box", "size": [1, 1, 1]}}]})");
  const Outcome run = offstage("validate s.json", folder.path());
  EXPECT_EQ(run.code, 0);
  EXPECT_NE(run.err.find("/bodies/2: body 'sunk' overlaps body 'floor' by 10 mm at time 0"),
            std::string::npos)
      << run.err;
  EXPECT_EQ(run.err.find("rests"), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("ghost"), std::string::npos) << run.err;
}

TEST(Commands, WrongUsageIsExit2) {
  const TemporaryFolder folder;
  for (const std::string& command :
       {std::string(), std::string("rendr x"), "render " + tiny_scene(),
        "render " + tiny_scene() + " -o film.avi", "render " + tiny_scene() + " -o out/ --frames 5-99",
        "render " + tiny_scene() + " -o out/ --chunk 3/2",
        "render " + tiny_scene() + " -o out/ --quality best", "frame " + tiny_scene() + " -o a.png --at 99"})
    EXPECT_EQ(offstage(command, folder.path()).code, 2) << command;
  EXPECT_TRUE(contents(folder.path()).empty());
}

TEST(Commands, HelpListsTheExitCodes) {
  const TemporaryFolder folder;
  const Outcome run = offstage("--help", folder.path());
  EXPECT_EQ(run.code, 0);
  EXPECT_NE(run.out.find("5 simulation diverged"), std::string::npos);
}

TEST(Commands, MissingFfmpegIsExit4BeforeAnythingIsWritten) {
  const TemporaryFolder folder;
  const Outcome run = offstage("render " + tiny_scene() + " -o film.mp4", folder.path(),
                               "OFFSTAGE_FFMPEG=/nonexistent/ffmpeg");
  EXPECT_EQ(run.code, 4);
  EXPECT_NE(run.err.find("ffmpeg"), std::string::npos) << run.err;
  EXPECT_TRUE(contents(folder.path()).empty());
}

TEST(Commands, DivergedSimulationIsExit5AndSavesTheState) {
  const TemporaryFolder folder;
  write_file(folder / "s.json",
             R"({"version": 1, "particles": [{"name": "doomed", "force": [1e308, 0, 0], "mass": 1e-6,
                 "places": [{"position": [0, 1, 0]}]}], "output": {"duration": 1}})");
  const Outcome run = offstage("simulate s.json", folder.path());
  EXPECT_EQ(run.code, 5) << run.err;
  EXPECT_NE(run.err.find("'doomed'"), std::string::npos) << run.err;
  const json state = json::parse(read_file(folder / "offstage-diverged.json"));
  EXPECT_EQ(state["not_finite"]["object"], "doomed");
  EXPECT_EQ(state["not_finite"]["position_before"], "0 1 0");
  EXPECT_NE(state["not_finite"]["velocity"].get<std::string>().find("inf"), std::string::npos);
}

/// Returns a scene with a crate of 8 kg that falls on the floor; `more` adds keys to the scene.
std::string falling_crate(const std::string& more) {
  return R"({"version": 1, "materials": [{"name": "wood", "restitution": 0}],
    "bodies": [{"name": "floor", "motion": "static", "shape": {"type": "plane"}, "material": "wood"},
               {"name": "crate", "mass": 8, "material": "wood", "position": [0, 0.6, 0]}],
    "output": {"duration": 1.5})" +
         more + "}";
}

TEST(Commands, ContactsOfARestingBodyCarryItsWeight) {
  const TemporaryFolder folder;
  for (const std::string solver : {"exact", "fast", "auto"}) {
    write_file(folder / "s.json", falling_crate(R"(, "world": {"solver": ")" + solver + R"("})"));
    const Outcome run = offstage("simulate s.json --contacts c.csv --force --progress none", folder.path());
    ASSERT_EQ(run.code, 0) << run.err;
    std::istringstream rows(read_file(folder / "c.csv"));
    std::string row;
    std::getline(rows, row);
    EXPECT_EQ(row, "time,a,b,x,y,z,nx,ny,nz,fx,fy,fz,separation");
    std::map<std::string, double> weight;  // sum of the vertical forces, by time
    while (std::getline(rows, row)) {
      std::istringstream cells(row);
      std::vector<std::string> cell(13);
      for (std::string& text : cell) std::getline(cells, text, ',');
      // the force acts on a, and the normal points from b to a
      const double up = cell[1] == "crate" ? 1 : -1;
      EXPECT_EQ(cell[1] == "crate" ? cell[2] : cell[1], "floor");
      EXPECT_NEAR(std::stod(cell[7]), up, 1e-9);
      EXPECT_NEAR(std::abs(std::stod(cell[3])), 0.5, 1e-3);
      weight[cell[0]] += up * std::stod(cell[10]);
    }
    ASSERT_GT(weight.size(), 30u) << solver;
    EXPECT_NEAR(weight.rbegin()->second, 8 * 9.81, 0.01) << solver;
  }
}

// Also with --force, which is for the results of earlier runs.
TEST(Commands, DoNotReplaceFilesThatTheSceneReads) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "look");
  ASSERT_EQ(offstage("frame " + tiny_scene() + " -o look/0001.png --quiet", folder.path()).code, 0);
  write_file(folder / "parts.json",
             R"({"bodies": [{"name": "ball", "shape": {"type": "sphere"}, "material": "m"}]})");
  write_file(folder / "s.json", R"({"version": 1, "include": ["parts.json"], "output": {"duration": 0.1},
    "materials": [{"name": "m", "texture": "look/0001.png"}]})");
  const auto before = contents(folder.path());
  for (const std::string command : {"simulate s.json --trace s.json", "simulate s.json --stats ./s.json",
                                    "simulate s.json --contacts parts.json", "frame s.json -o look/0001.png",
                                    "render s.json --frames 1 -o look/####.png"}) {
    const Outcome run = offstage(command + " --force --quiet", folder.path());
    EXPECT_EQ(run.code, 2) << command;
    EXPECT_NE(run.err.find("is read by the scene; give the output another name"), std::string::npos)
        << run.err;
    EXPECT_EQ(contents(folder.path()), before) << command;
  }
}

TEST(Commands, FiguresOfContactsAreInTheStats) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", falling_crate(R"(, "world": {"solver": "exact", "sleep": false})"));
  const Outcome run = offstage("simulate s.json --progress none", folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "") << "there are no warnings";
  const json stats = json::parse(run.out);
  EXPECT_EQ(stats["contacts"], 4);
  EXPECT_EQ(stats["islands"], 1);
  EXPECT_EQ(stats["bodies_awake"], 1);
  EXPECT_GE(stats["most_contacts"], 4);
  EXPECT_GE(stats["collisions"], 1);
  EXPECT_LT(stats["penetration"], 1e-3);
  EXPECT_GT(stats["exact_solver"]["solves"], 0);
  for (const char* solver : {"exact_solver", "fast_solver", "impact_solver"})
    EXPECT_EQ(stats[solver]["fallbacks"], 0);
  EXPECT_NEAR(stats["energy_end"]["potential"].get<double>(), 8 * 9.81 * 0.5, 0.1);
}

TEST(Commands, TwoOutputsNeverShareAFile) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", falling_crate(""));
  EXPECT_EQ(offstage("simulate s.json --trace a.csv --contacts ./a.csv", folder.path()).code, 2);
  EXPECT_EQ(offstage("simulate s.json --stats a.csv --contacts a.csv", folder.path()).code, 2);
  EXPECT_EQ(contents(folder.path()).size(), 1u);
}

TEST(Commands, BenchPrintsATableOfMethods) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", falling_crate(""));
  const Outcome run = offstage("bench s.json --repeat 2 --csv b.csv", folder.path());
  EXPECT_EQ(run.code, 0) << run.err;
  for (const char* text : {"method", "steps/s", "\nscene ", "\ncollision.impact_time=bisection "})
    EXPECT_NE(run.out.find(text), std::string::npos) << run.out;
  EXPECT_TRUE(std::filesystem::exists(folder / "b.csv"));
  EXPECT_EQ(offstage("bench s.json --csv b.csv", folder.path()).code, 2);
  const Outcome piped = offstage("bench - < s.json", folder.path());
  EXPECT_EQ(piped.code, 0) << piped.err;
  const Outcome brief =
      offstage("bench s.json --duration 0.1 --fps 30 --progress plain --csv c.csv", folder.path());
  EXPECT_EQ(brief.code, 0) << brief.err;
  EXPECT_NE(brief.err.find("run 1 of 8: scene  "), std::string::npos) << brief.err;
  std::istringstream table(read_file(folder / "c.csv"));
  std::string heading, first;
  std::getline(table, heading);
  std::getline(table, first);
  EXPECT_NE(first.find(",16,"), std::string::npos) << first;  // steps: two frames of eight
  const Outcome cut = offstage("bench s.json --limit 1e-9", folder.path());
  EXPECT_EQ(cut.code, 0) << cut.err;
  EXPECT_NE(cut.out.find("stopped by --limit"), std::string::npos) << cut.out;
  EXPECT_EQ(offstage("bench s.json --limit 0", folder.path()).code, 2);
}

TEST(Commands, OverridesAreCheckedLikeTheFile) {
  const TemporaryFolder folder;
  EXPECT_EQ(offstage("validate " + tiny_scene() + " --set emitters.0.rate=200", folder.path()).code, 0);
  EXPECT_EQ(offstage("validate " + tiny_scene() + " --set emitters.0.rte=200", folder.path()).code, 3);
  EXPECT_EQ(offstage("validate " + tiny_scene() + " --set emitters.0.radius=-1", folder.path()).code, 3);
}

TEST(Commands, DryRunPrintsAPlanAndWritesNothing) {
  const TemporaryFolder folder;
  const Outcome run =
      offstage("render " + tiny_scene() + " -o out/####.png --frames 2-9x3 --dry-run", folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(json::parse(run.out)["frames"], 3);
  EXPECT_TRUE(contents(folder.path()).empty());
}

TEST(Commands, StatsAreOneJsonObject) {
  const TemporaryFolder folder;
  const Outcome run =
      offstage("render " + tiny_scene() + " -o out/ --frames 1-4 --stats stats.json -q", folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const json stats = json::parse(read_file(folder / "stats.json"));
  EXPECT_EQ(stats["frames"], 4);
  EXPECT_EQ(stats["bodies"], 3);
  EXPECT_GT(stats["particles"], 20);
  EXPECT_EQ(stats["state_hash"].get<std::string>().size(), 32u);
  for (const char* stage : {"sim_ms", "render_ms", "encode_ms"})
    EXPECT_GE(stats[stage]["max"], stats[stage]["p50"]);
}

/// Rows of one object in a trace.
std::vector<std::vector<double>> rows_of(const std::string& trace, const std::string& object) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(trace);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::string time, name, cell;
    std::getline(cells, time, ',');
    std::getline(cells, name, ',');
    if (name != object) continue;
    rows.push_back({std::stod(time)});
    while (std::getline(cells, cell, ',')) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

TEST(Commands, TraceOfAFreeBodyIsTheClosedForm) {
  const TemporaryFolder folder;
  const Outcome run =
      offstage("simulate " + tiny_scene() + " --trace t.csv --trace-every step", folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  const auto rows = rows_of(read_file(folder / "t.csv"), "thrown");
  ASSERT_EQ(rows.size(), 11u * 10 + 1) << "11 frame intervals of 10 steps, and the last state";
  for (const auto& row : rows) {
    const double t = row[0];
    EXPECT_NEAR(row[1], -1 + t, 1e-12);
    EXPECT_NEAR(row[2], 1 + 4 * t - 0.5 * 9.81 * t * t, 1e-12);
    EXPECT_NEAR(row[9], 4 - 9.81 * t, 1e-12);
  }
}

TEST(Commands, InfoDescribesScenesAndModels) {
  const TemporaryFolder folder;
  const Outcome scene = offstage("info " + tiny_scene() + " --json", folder.path());
  ASSERT_EQ(scene.code, 0) << scene.err;
  EXPECT_EQ(json::parse(scene.out)["frames"], 12);
  // A unit cube as OBJ: closed, volume 1.
  write_file(folder / "cube.obj",
             "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
             "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const Outcome model = offstage("info cube.obj --json", folder.path());
  ASSERT_EQ(model.code, 0) << model.err;
  const json cube = json::parse(model.out);
  EXPECT_EQ(cube["triangles"], 12);
  EXPECT_EQ(cube["closed"], true);
  EXPECT_NEAR(cube["volume"].get<double>(), 1, 1e-9);
  EXPECT_EQ(cube["convex_parts"]["method"], "convex");
  EXPECT_EQ(cube["convex_parts"]["count"], 1);
}

TEST(Commands, ConvexPartsAreCachedOnDiskUnlessDisabled) {
  const TemporaryFolder folder;
  // An L: two bars whose cross-section is a unit square.
  write_file(folder / "l.obj",
             "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 "
             "2 1\nv 0 2 1\n"
             "f 1 4 3 2\nf 1 6 5 4\nf 7 8 9 10\nf 7 10 11 12\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 "
             "10\nf 5 6 12 11\n"
             "f 6 1 7 12\n");
  const auto cache = folder / "kept";
  const std::string there = "XDG_CACHE_HOME='" + cache.string() + "'";
  const Outcome without = offstage("info l.obj --json --no-cache", folder.path(), there);
  ASSERT_EQ(without.code, 0) << without.err;
  EXPECT_FALSE(std::filesystem::exists(cache));
  const Outcome first = offstage("info l.obj --json", folder.path(), there);
  EXPECT_EQ(contents(cache).size(), 1u);
  const Outcome second = offstage("info l.obj --json", folder.path(), there);
  EXPECT_EQ(first.out, without.out);
  EXPECT_EQ(second.out, without.out);
  EXPECT_EQ(json::parse(first.out)["convex_parts"]["method"], "exact");
  EXPECT_EQ(json::parse(first.out)["convex_parts"]["count"], 2);
}

TEST(Commands, AnLWithCapsOfSixCornersHasTwoExactParts) {
  const TemporaryFolder folder;
  write_file(folder / "l.obj",
             "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 "
             "2 1\nv 0 2 1\n"
             "f 1 6 5 4 3 2\nf 7 8 9 10 11 12\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\n"
             "f 6 1 7 12\n");
  const json parts = json::parse(offstage("info l.obj --json --no-cache", folder.path()).out)["convex_parts"];
  EXPECT_EQ(parts["method"], "exact");
  EXPECT_EQ(parts["count"], 2);
}

TEST(Commands, BodiesThatLeaveTheWorldAreNamed) {
  const TemporaryFolder folder;
  write_file(
      folder / "s.json",
      R"({"version": 1, "world": {"bounds": 2}, "bodies": [{"name": "runaway"}], "output": {"duration": 2}})");
  const Outcome run = offstage("simulate s.json --progress none", folder.path());
  EXPECT_EQ(run.code, 0);
  EXPECT_NE(run.err.find("'runaway' left world.bounds"), std::string::npos) << run.err;
  EXPECT_EQ(json::parse(run.out)["lost_bodies"][0], "runaway");
}

TEST(Commands, FrameTimesOutsideTheFilmAreRefused) {
  const TemporaryFolder folder;
  for (const char* at : {"-1", "nan", "1e300", "1e9", "0.5", "-0.2"}) {
    const Outcome run = offstage("frame " + tiny_scene() + " -o a.png --at=" + at, folder.path());
    EXPECT_EQ(run.code, 2) << at;
    EXPECT_NE(run.err.find("outside the film, which shows 0 to"), std::string::npos) << run.err;
  }
  EXPECT_EQ(offstage("frame " + tiny_scene() + " -o a.jpg -n 1", folder.path()).code, 2);
  EXPECT_TRUE(contents(folder.path()).empty());
}

TEST(Commands, ClosedStreamsOfMessagesDoNotEndTheRun) {
  const TemporaryFolder folder;
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o a/ --frames 1-2 2>/dev/full", folder.path()).code, 0);
  EXPECT_EQ(offstage("validate nowhere.json 2>&-", folder.path()).code, 3);
  EXPECT_EQ(offstage("frame " + tiny_scene() + " -o f.png -q <&- >&- 2>&-", folder.path()).code, 0);
  EXPECT_EQ(read_file(folder / "f.png"), read_file(folder / "a/0001.png"));
}

TEST(Commands, UnwritableResultsAreErrors) {
  const TemporaryFolder folder;
  for (const std::string& command : {std::string("schema"), std::string("doctor"), "validate " + tiny_scene(),
                                     "simulate " + tiny_scene() + " -q"})
    EXPECT_EQ(offstage(command + " >/dev/full", folder.path()).code, 1) << command;
}

TEST(Commands, StatsNeverReplaceAFileUnasked) {
  const TemporaryFolder folder;
  write_file(folder / "notes.json", "mine");
  EXPECT_EQ(offstage("simulate " + tiny_scene() + " --stats notes.json", folder.path()).code, 2);
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o out/ --stats notes.json", folder.path()).code, 2);
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o out/ --stats nowhere/s.json", folder.path()).code, 2);
  EXPECT_EQ(offstage("render " + tiny_scene() + " -o a.mp4 --stats ./a.mp4", folder.path()).code, 2);
  EXPECT_EQ(contents(folder.path()), (std::map<std::string, std::string>{{"notes.json", "mine"}}));
}

TEST(Commands, DoctorFindsGlAndEncoders) {
  const TemporaryFolder folder;
  const Outcome run = offstage("doctor", folder.path());
  EXPECT_EQ(run.code, 0) << run.out;
  EXPECT_NE(run.out.find("llvmpipe"), std::string::npos);
  EXPECT_NE(run.out.find("libx264"), std::string::npos);
}

TEST(Commands, SchemaIsJsonAndNamesEverySection) {
  const TemporaryFolder folder;
  const json schema = json::parse(offstage("schema", folder.path()).out);
  for (const char* section : {"world", "materials", "bodies", "particles", "emitters", "springs", "contacts",
                              "forces", "overlays", "camera", "lights", "environment", "render", "output"})
    EXPECT_TRUE(schema["properties"].contains(section)) << section;
}

TEST(Commands, ManualAndCompletionsHaveEveryCommandAndOption) {
  const TemporaryFolder folder;
  std::vector<std::string> texts;
  for (const char* command : {"man", "completion bash", "completion zsh", "completion fish"}) {
    const Outcome run = offstage(command, folder.path());
    ASSERT_EQ(run.code, 0) << command << run.err;
    texts.push_back(run.out);
  }
  std::erase(texts[0], '\\');  // the manual writes hyphens as "\-"
  for (const std::string command : {"render", "simulate", "compare", "bless", "doctor", "completion"}) {
    for (const std::string& text : texts) EXPECT_NE(text.find(command), std::string::npos) << command;
    std::istringstream help(offstage(command + " --help", folder.path()).out);
    for (std::string line; std::getline(help, line);) {
      const std::size_t dashes = line.find("--");  // a line of the help such as "  -o,--output TEXT REQUIRED"
      if (!line.starts_with("  -") || dashes > 5) continue;
      const std::string name = line.substr(dashes + 2, line.find(' ', dashes) - dashes - 2);
      for (std::size_t i = 0; i < texts.size(); ++i)
        EXPECT_NE(texts[i].find((i == 3 ? "-l " : "--") + name), std::string::npos)
            << command << " --" << name;
    }
  }
  EXPECT_EQ(offstage("completion tcsh", folder.path()).code, 2);
}

TEST(Commands, AModelIsFoundBesideTheSceneOrInTheInstalledModels) {
  const TemporaryFolder folder;
  const auto with = [&](const std::string& file) {
    write_file(folder / "s.json",
               R"({"version": 1, "bodies": [{"motion": "static", "shape": {"type": "mesh", "file": ")" +
                   file + R"("}}], "output": {"duration": 0.1}})");
    return offstage("simulate s.json", folder.path());
  };
  EXPECT_EQ(with("duck.glb").code, 0) << "the model in assets/models";
  write_file(folder / "duck.glb", "not a model");
  EXPECT_EQ(with("duck.glb").code, 3) << "a file in the scene's folder has priority";
  EXPECT_EQ(with("./rock.glb").code, 3) << "a name with a folder is not searched in assets/models";
  EXPECT_EQ(with("no_such.glb").code, 3);
}

}  // namespace
}  // namespace offstage::test
