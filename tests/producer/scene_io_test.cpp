#include "producer/format/scene_io.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "effects/random.h"
#include "producer/sample_scene.h"

namespace offstage::producer {
namespace {

Scene loaded_scene(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "s", OFFSTAGE_SOURCE_DIR, overrides).scene;
}

/// Returns all problems of a scene, one per line.
std::string load_errors(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    parse_scene(text, "s", OFFSTAGE_SOURCE_DIR, overrides);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

// --- Reading ---

TEST(ParseScene, KeysOfEarlierVersionsAreWarnedOf) {
  const LoadedScene old = parse_scene(
      "{\"environment\": {\"intensity\": 2, \"occlusion\": 0},\n \"render\": {\"shadow_map\": 1024}}",
      "scene", "");
  EXPECT_EQ(old.scene.environment.intensity, 2);
  ASSERT_EQ(old.warnings.size(), 2u);
  EXPECT_EQ(old.warnings[0].where.path, "/environment/occlusion");
  EXPECT_EQ(old.warnings[1].where.path, "/render/shadow_map");
  EXPECT_EQ(old.warnings[1].where.line, 2);
  EXPECT_NE(old.warnings[0].what.find("no effect"), std::string::npos);
  EXPECT_EQ(old.canonical.find("occlusion"), std::string::npos);
}

TEST(SceneIo, AnEmptySceneIsAllDefaults) {
  const Scene scene = loaded_scene("{}");
  EXPECT_EQ(scene.name, "s");
  EXPECT_EQ(scene.world.gravity, Vec3(0, -9.81, 0));
  EXPECT_EQ(scene.lights.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<StaticCamera>(scene.camera));
  EXPECT_EQ(scene.frame_count(), 150);
}

TEST(SceneIo, EveryPartOfTheSampleArrives) {
  const Scene scene = loaded_scene(kSampleScene);
  EXPECT_EQ(scene.world.integrator, sim::IntegratorKind::midpoint);
  EXPECT_EQ(scene.world.seed, 42u);
  EXPECT_EQ(scene.bodies.size(), 3u + 12 + 5);
  EXPECT_EQ(scene.bodies[0].motion, sim::MotionType::static_body);
  EXPECT_EQ(scene.bodies[2].keyframes[1].position, Vec3(1, 1, 0));
  EXPECT_EQ(scene.particles[0].places[1].color->rgba, Eigen::Vector4f(1, 0, 0, 1));
  const Emitter& rain = scene.emitters[0];
  EXPECT_EQ(std::get<effects::Normal>(rain.rate).deviation, 20);
  EXPECT_EQ(std::get<effects::Uniform>(rain.speed).high, 2);
  EXPECT_EQ(std::get<effects::Curve>(rain.lifespan).keys[1], std::pair(2.0, 1.5));
  EXPECT_EQ(std::get<Real>(rain.spread_deg), 5);
  EXPECT_TRUE(rain.behaviour.dies_on_hit);
  EXPECT_EQ(rain.look.style, LookStyle::streak);
  EXPECT_EQ(rain.look.size_over_age[1], std::pair(1.0, 0.5));
  EXPECT_FALSE(scene.emitters[1].behaviour.gravity);
  EXPECT_EQ(scene.springs[0].name, "spring_0");
  EXPECT_EQ(std::get<KeyframedCamera>(scene.camera).keyframes[1].eye, Vec3(0, 2, 7));
  EXPECT_EQ(scene.render.tone_curve, render::ToneCurve::linear);
  EXPECT_EQ(scene.frame_count(), 72);
}

TEST(SceneIo, ColoursAreSrgbTextOrLinearNumbers) {
  const Scene scene =
      loaded_scene(R"({"materials": [{"color": "#ff8000"}, {"color": "#00000080"}, {"color": [2, 0.5, 0]},
                                                 {"color": [0, 0, 0, 0.25]}]})");
  const Eigen::Vector4f orange(1, 0.21586050f, 0, 1);  // 0x80 / 255, decoded according to IEC 61966-2-1
  EXPECT_LT((scene.materials[0].color.rgba - orange).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_FLOAT_EQ(scene.materials[1].color.rgba[3], 128 / 255.f);
  EXPECT_EQ(scene.materials[2].color.rgba, Eigen::Vector4f(2, 0.5f, 0, 1));
  EXPECT_EQ(scene.materials[3].color.rgba, Eigen::Vector4f(0, 0, 0, 0.25f));
  EXPECT_EQ(load_errors(R"({"materials": [{"color": "#ff80"}, {"color": "#ff80zz"}, {"color": "#+10203"},
{"color": [1, 1]}, {"color": [1, -1, 0]}, {"color": [0, 0, 0, 2]}]})"),
            "s:1:46: /materials/1/color: must be \"#rrggbb\", \"#rrggbbaa\", \"#rgb\", \"#rgba\" or a list "
            "of 3 or 4 numbers, got "
            "the string "
            "\"#ff80zz\"\n"
            "s:1:68: /materials/2/color: must be \"#rrggbb\", \"#rrggbbaa\", \"#rgb\", \"#rgba\" or a list "
            "of 3 or 4 numbers, got "
            "the string "
            "\"#+10203\"\n"
            "s:2:11: /materials/3/color: must be \"#rrggbb\", \"#rrggbbaa\", \"#rgb\", \"#rgba\" or a list "
            "of 3 or 4 numbers, got "
            "2 items\n"
            "s:2:34: /materials/4/color/1: must be between 0 and 1000000, got -1\n"
            "s:2:63: /materials/5/color/3: must be between 0 and 1, got 2");
}

TEST(SceneIo, OrientationsAreQuaternionsOrAxisAndAngle) {
  const Scene scene = loaded_scene(
      R"({"bodies": [{"orientation": [2, 0, 0, 2]}, {"orientation": {"axis": [0, 0, 5], "angle_deg": 90}},
                                              {"orientation": {"axis": [0, 1, 0], "angle_deg": -720}}]})");
  const Quat quarter(std::sqrt(0.5), 0, 0, std::sqrt(0.5));
  EXPECT_LT((scene.bodies[0].orientation.coeffs() - quarter.coeffs()).norm(), 1e-15);
  EXPECT_LT((scene.bodies[1].orientation.coeffs() - quarter.coeffs()).norm(), 1e-15);
  EXPECT_LT(scene.bodies[2].orientation.angularDistance(Quat::Identity()), 1e-7);
  EXPECT_EQ(
      load_errors(
          R"({"bodies": [{"orientation": [0, 0, 0, 0]}, {"orientation": {"axis": [0, 0, 0], "angle_deg": 1}},
{"orientation": {"axis": [1, 0, 0], "angel_deg": 1}}, {"orientation": 90}]})"),
      "s:1:29: /bodies/0/orientation: must be a vector that is not zero, got [0,0,0,0]\n"
      "s:1:69: /bodies/1/orientation/axis: must be a vector that is not zero, got [0,0,0]\n"
      "s:2:17: /bodies/2/orientation/angle_deg: is required: angle of rotation about the axis\n"
      "s:2:37: /bodies/2/orientation/angel_deg: unknown key in orientation; did you mean 'angle_deg'?\n"
      "s:2:71: /bodies/3/orientation: must be [w, x, y, z] or {\"axis\": [x, y, z], \"angle_deg\": a}, got "
      "90");
}

TEST(SceneIo, DistributionsMustStayInTheirRange) {
  const auto radius = [](const std::string& value) {
    return load_errors(R"({"emitters": [{"radius": )" + value + "}]}");
  };
  EXPECT_EQ(radius(R"({"mean": 0.02, "deviation": 0.01})"), "");
  EXPECT_EQ(radius(R"({"mean": 0.02, "deviation": 0.03, "min": 0.001})"), "");
  EXPECT_EQ(radius(R"({"mean": 0.02, "deviation": 0.02})"),
            "s:1:26: /emitters/0/radius: can become too small: must be greater than 1e-09 and at most "
            "1000000000 m; give \"min\"");
  EXPECT_EQ(radius(R"({"mean": 0.02, "deviation": 0.01, "clip": false})"),
            "s:1:26: /emitters/0/radius: can become too small: must be greater than 1e-09 and at most "
            "1000000000 m; give \"min\"");
  EXPECT_EQ(radius(R"({"range": [0, 1]})"),
            "s:1:37: /emitters/0/radius/range/0: must be greater than 1e-09 and at most 1000000000 m, got 0");
  EXPECT_EQ(radius(R"({"range": [0.02, 0.01]})"),
            "s:1:36: /emitters/0/radius/range: must be [low, high] with low <= high, got [0.02, 0.01]");
  EXPECT_EQ(radius(R"({"curve": [[0, 0.01], [1, 0.02], [1, 0.03]]})"),
            "s:1:59: /emitters/0/radius/curve/2: times must increase");
  EXPECT_EQ(radius(R"({"curve": []})"),
            "s:1:36: /emitters/0/radius/curve: must be a list of at least one [time, value], got 0 items");
  EXPECT_EQ(radius(R"({"maen": 1})"),
            "s:1:26: /emitters/0/radius/mean: is required: mean of the normal distribution\n"
            "s:1:27: /emitters/0/radius/maen: unknown key in varying number; did you mean 'mean'?");
}

TEST(SceneIo, ClosedLimitsTruncateANormalDistribution) {
  const Scene scene =
      loaded_scene(R"({"emitters": [{"restitution": {"mean": 0.9, "deviation": 0.5, "clip": false}}]})");
  const auto& normal = std::get<effects::Normal>(scene.emitters[0].restitution);
  EXPECT_EQ(normal.min, 0);
  EXPECT_EQ(normal.max, 1);
}

TEST(SceneIo, OmittedTypesHaveDefaultsOrAreReported) {
  EXPECT_TRUE(std::holds_alternative<StaticCamera>(loaded_scene(R"({"camera": {"eye": [0, 1, 9]}})").camera));
  EXPECT_EQ(
      load_errors(R"({"bodies": [{"shape": {"radius": 1}}]})"),
      "s:1:23: /bodies/0/shape/type: is required; it must be one of \"sphere\", \"box\", \"capsule\", "
      "\"cylinder\", \"cone\", "
      "\"plane\", \"mesh\", \"frustum\", \"ellipsoid\", \"torus\", \"tube\", \"open_box\" or \"compound\"");
}

TEST(SceneIo, CanonicalOfCanonicalIsTheSame) {
  for (const char* text : {"{}", kSampleScene}) {
    const std::string canonical = parse_scene(text, "s", OFFSTAGE_SOURCE_DIR).canonical;
    EXPECT_EQ(parse_scene(canonical, "other", OFFSTAGE_SOURCE_DIR).canonical, canonical);
  }
}

TEST(SceneIo, CanonicalDoesNotDependOnHowASceneIsWritten) {
  EXPECT_EQ(parse_scene(R"({"world": {"step": 5e-3, "seed": 1}, "bodies": [{}]})", "s", "").canonical,
            parse_scene(R"({"bodies": [{"name": "body_0"}], /* same */ "world": {"step": 0.005}})", "s", "")
                .canonical);
  EXPECT_NE(parse_scene("{}", "s", "").canonical,
            parse_scene(R"({"world": {"seed": 2}})", "s", "").canonical);
}

// --- Errors ---

TEST(SceneIo, EveryProblemIsReportedAtOnceInOrder) {
  EXPECT_EQ(load_errors(R"({
  "bodies": [
    {"shape": {"type": "sphere", "raduis": 1}},
    {"motion": "dynamc"},
    {"shape": {"type": "sphere", "radius": -1}, "position": [1, "x", 2], "mass": true}
  ],
  "camera": {"type": "orbit", "radius": 0},
  "render": {"size": [8, 100.5]},
  "version": 2,
  "wrold": {}
})"),
            "s:3:34: /bodies/0/shape/raduis: unknown key in sphere; did you mean 'radius'?\n"
            "s:4:16: /bodies/1/motion: must be one of \"static\", \"kinematic\" or \"dynamic\", got the "
            "string \"dynamc\"; "
            "did you mean 'dynamic'?\n"
            "s:5:44: /bodies/2/shape/radius: must be greater than 1e-09 and at most 1000000000 m, got -1\n"
            "s:5:65: /bodies/2/position/1: must be a number, got the string \"x\"\n"
            "s:5:82: /bodies/2/mass: must be a number, got true\n"
            "s:7:41: /camera/radius: must be greater than 1e-09 and at most 1000000000 m, got 0\n"
            "s:8:23: /render/size/0: must be between 16 and 16384 pixels, got 8\n"
            "s:8:26: /render/size/1: must be a whole number, got 100.5\n"
            "s:9:14: /version: must be 1, got 2\n"
            "s:10:3: /wrold: unknown key in scene; did you mean 'world'?");
}

TEST(SceneIo, MessagesAboutWrongKeysNameThePlaceOfTheRightOnes) {
  EXPECT_EQ(load_errors(R"({"bodies": [{"shape": {"type": "torus", "tube": 0.1}}]})"),
            "s:1:41: /bodies/0/shape/tube: unknown key in torus; did you mean 'tube_radius'?");
  EXPECT_EQ(load_errors(R"({"bodies": [{"rolling_friction": 0.5}]})"),
            "s:1:14: /bodies/0/rolling_friction: unknown key in body; 'rolling_friction' is a key of: "
            "material, contact");
  EXPECT_EQ(load_errors(R"({"bodies": [{"material": {"friction": 0.5}}]})"),
            "s:1:26: /bodies/0/material: must be a string (name of a material; empty: grey, or the materials "
            "of the model file), got an object");
}

TEST(SceneIo, MissingRequiredKeysAreReported) {
  EXPECT_EQ(
      load_errors(
          R"({"bodies": [{"shape": {"type": "mesh"}, "model": {"file": ""}}], "camera": {"type": "follow"}})"),
      "s:1:23: /bodies/0/shape/file: is required: model file relative to the scene, or the name of a model "
      "that comes with offstage; FILE#NODE selects one node\n"
      "s:1:59: /bodies/0/model/file: must not be empty\n"
      "s:1:76: /camera/body: is required: name of the body");
}

TEST(SceneIo, ASceneIsAnObject) {
  EXPECT_EQ(load_errors("[1]"), "s:1:1: must be an object, got [1]");
  EXPECT_EQ(load_errors(R"({"bodies": {}})"), "s:1:12: /bodies: must be a list, got an object");
}

TEST(SceneIo, AMissingFileAndAFolderAreNamed) {
  EXPECT_THROW(load_scene("/nowhere/scene.json"), SceneError);
  try {
    load_scene(OFFSTAGE_SOURCE_DIR);
    FAIL();
  } catch (const SceneError& error) {
    EXPECT_STREQ(error.what(), OFFSTAGE_SOURCE_DIR ": is a folder, not a file");
  }
}

// --- Includes ---

class SceneInclude : public testing::Test {
 protected:
  SceneInclude() {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder / "parts");
  }
  ~SceneInclude() override { std::filesystem::remove_all(folder); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder / name) << text; }
  std::string errors(const std::string& name) const {
    try {
      load_scene(folder / name);
    } catch (const SceneError& error) {
      return error.what();
    }
    return "";
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }

  const std::filesystem::path folder =
      std::filesystem::path(OFFSTAGE_BINARY_DIR) /
      (std::string("include_test_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(SceneInclude, JoinsListsAndMergesObjectsAndTheIncluderWins) {
  write("a.json", R"({"include": ["parts/b.json"], "world": {"step": 0.01}, "bodies": [{"name": "own"}],
                      "camera": {"type": "orbit"}, "lights": []})");
  write("parts/b.json", R"({"include": ["c.json"], "world": {"step": 0.02, "gravity": [0, -1, 0]},
                            "bodies": [{"name": "b"}], "camera": {"eye": [1, 1, 1]}})");
  write("parts/c.json", R"({"$schema": "x", "version": 1, "bodies": [{"name": "c"}], "name": "c"})");
  const LoadedScene loaded = load_scene(folder / "a.json");
  const Scene& scene = loaded.scene;
  ASSERT_EQ(scene.bodies.size(), 3u);
  EXPECT_EQ(scene.bodies[0].name + scene.bodies[1].name + scene.bodies[2].name, "cbown");
  EXPECT_EQ(scene.world.max_step, 0.01);
  EXPECT_EQ(scene.world.gravity, Vec3(0, -1, 0));
  EXPECT_EQ(scene.name, "c");
  EXPECT_EQ(loaded.folder.path(), folder);
  EXPECT_EQ(scene.bodies[1].where.file, path("parts/b.json"));
}

TEST_F(SceneInclude, AnObjectThatNamesItsTypeReplacesOneOfAnother) {
  write("a.json", R"({"include": ["b.json"], "camera": {"type": "orbit"}})");
  write("b.json", R"({"camera": {"type": "static", "eye": [1, 1, 1], "fov_deg": 20}})");
  EXPECT_EQ(std::get<OrbitCamera>(load_scene(folder / "a.json").scene.camera).fov_deg, 40);
  write("a.json", R"({"include": ["b.json"], "camera": {"target": [0, 3, 0]}})");
  EXPECT_EQ(std::get<StaticCamera>(load_scene(folder / "a.json").scene.camera).fov_deg, 20);
}

TEST_F(SceneInclude, MessagesNameTheFileThatIsWrong) {
  write("a.json", R"({"include": ["parts/b.json", "nix.json", 3, "bad.json"], "world": {"stpe": 1}})");
  write("parts/b.json", "{\n \"world\": {\"sede\": 1}}");
  write("bad.json", "{\"a\": }");
  EXPECT_EQ(errors("a.json"), path("a.json") + ":1:30: /include/1: '" + path("nix.json") +
                                  "': no such file\n" + path("a.json") +
                                  ":1:42: /include/2: must be a file name, got 3\n" + path("bad.json") +
                                  ":1:7: unexpected '}'; expected '[', '{', or a literal");
  write("a.json", R"({"include": ["parts/b.json"], "world": {"stpe": 1}})");
  EXPECT_EQ(errors("a.json"),
            path("a.json") + ":1:41: /world/stpe: unknown key in world; did you mean 'step'?\n" +
                path("parts/b.json") + ":2:12: /world/sede: unknown key in world; did you mean 'seed'?");
}

TEST_F(SceneInclude, CyclesAreRefusedAndRepetitionIsBounded) {
  write("a.json", R"({"include": ["parts/b.json"]})");
  write("parts/b.json", R"({"include": ["../parts/../a.json"]})");
  EXPECT_EQ(errors("a.json"),
            path("parts/b.json") + ":1:14: /include/0: '../parts/../a.json' includes itself");
  for (int i = 0; i < 20; ++i) {
    const std::string next = "\"" + std::to_string(i + 1) + ".json\"";
    write(std::to_string(i) + ".json", "{\"include\": [" + next + ", " + next + "]}");
  }
  write("20.json", "{}");
  EXPECT_NE(errors("0.json").find("more than 256 files"), std::string::npos);
}

// --- Overrides ---

TEST(SceneOverride, ReachesAnyKeyByIndexNameOrPointer) {
  const std::string text =
      R"({"emitters": [{"name": "rain", "rate": 5}, {"name": "a.b/c"}], "bodies": [{"position": [1, 2, 3]}]})";
  const Scene scene =
      loaded_scene(text, {"emitters.rain.rate={\"mean\": 7, \"deviation\": 1}", "/emitters/a.b~1c/speed=3",
                          "emitters.1.look.lit=false", "bodies.0.position.1=9", "bodies.0.name=red ball",
                          "render.quality=final", "output.duration=2", "lights.0.intensity=9",
                          "camera.type=orbit", "camera.radius=12", "world.gravity.1=-1"});
  EXPECT_EQ(std::get<effects::Normal>(scene.emitters[0].rate).mean, 7);
  EXPECT_EQ(std::get<Real>(scene.emitters[1].speed), 3);
  EXPECT_EQ(scene.emitters[1].look.lit, false);
  EXPECT_EQ(scene.bodies[0].position, Vec3(1, 9, 3));
  EXPECT_EQ(scene.bodies[0].name, "red ball");
  EXPECT_EQ(scene.render.quality, Quality::final);
  EXPECT_EQ(scene.output.duration, 2);
  EXPECT_EQ(std::get<SunLight>(scene.lights[0]).intensity, 9) << "the default sun can be reached";
  EXPECT_EQ(std::get<OrbitCamera>(scene.camera).radius, 12);
  EXPECT_EQ(scene.world.gravity, Vec3(0, -1, 0));
}

TEST(SceneOverride, IsCheckedLikeTheFile) {
  const std::string text = R"({"emitters": [{"name": "rain", "rate": 5}]})";
  const auto error = [&](const std::string& override) { return load_errors(text, {override}); };
  EXPECT_EQ(error("emitters.rani.rate=1"), "--set: /emitters: has no 'rani'; did you mean 'rain'?");
  EXPECT_EQ(error("emitters.3.rate=1"), "--set: /emitters: has no '3'; it has 1 items");
  EXPECT_EQ(error("emitters.0.raet=1"),
            "--set: /emitters/0/raet: unknown key in emitter; did you mean 'rate'?");
  EXPECT_EQ(error("emitters.0.rate.mean=1"),
            "--set: /emitters/0/rate: is 5 and has no 'mean'; set it as a whole");
  EXPECT_EQ(error("world.step=fast"), "--set: /world/step: must be a number, got the string \"fast\"");
  EXPECT_EQ(error("world.step=-1"), "--set: /world/step: must be between 1e-06 and 1 s, got -1");
  EXPECT_EQ(error("bodies.ball.mass=1"), "--set: /bodies: has no 'ball'; it is empty");
  EXPECT_EQ(error("duration"), "--set: must be path=value, got 'duration'");
  EXPECT_EQ(error("=3"), "--set: must be path=value, got '=3'");
  EXPECT_EQ(error("bodies=[{\"shape\": {\"type\": \"bocks\"}}]")
                .rfind("--set: /bodies/0/shape/type: must be one of", 0),
            0u);
}

TEST(SceneOverride, ChangesTheCanonicalSceneAsTheFileWould) {
  EXPECT_EQ(parse_scene("{}", "s", "", {"world.seed=9"}).canonical,
            parse_scene(R"({"world": {"seed": 9}})", "s", "").canonical);
}

// --- Robustness ---

TEST(SceneIo, DamagedTextIsRefusedOrReadButNothingElseHappens) {
  const std::string sample = kSampleScene;
  const effects::RandomStream random(11, 1);
  static const std::string kBits = "{}[]\",:0-9.eE/*\\ \n\tx\x80\xff#u";
  int refused = 0;
  for (uint64_t i = 0; i < 4000; ++i) {
    std::string text = sample;
    for (uint64_t edits = 1 + random.below(3, i, 0), e = 0; e < edits; ++e) {
      const auto draw = [&](uint64_t n, uint32_t property) { return random.below(n, i * 8 + e, property); };
      const std::size_t at = draw(text.size(), 1), length = draw(30, 2);
      switch (draw(5, 3)) {
        case 0:
          text[at] = kBits[draw(kBits.size(), 4)];
          break;
        case 1:
          text.erase(at, length);
          break;
        case 2:
          text.insert(at, 1, kBits[draw(kBits.size(), 4)]);
          break;
        case 3:
          text.insert(at, text.substr(draw(text.size(), 5), length));
          break;
        case 4:
          text.resize(std::max<std::size_t>(at, 1));
          break;
      }
    }
    try {
      parse_scene(text, "s", OFFSTAGE_SOURCE_DIR);
    } catch (const SceneError& error) {
      ++refused;
      ASSERT_FALSE(error.problems().empty());
      ASSERT_FALSE(error.problems().front().what.empty());
    }
  }
  EXPECT_GT(refused, 2000);
  EXPECT_LT(refused, 4000);
}

TEST(SceneIo, ShortColoursDoubleTheirDigits) {
  const auto color_of = [](const std::string& text) {
    return loaded_scene(R"({"materials": [{"name": "m", "color": ")" + text + "\"}]}")
        .materials[0]
        .color.rgba;
  };
  EXPECT_EQ(color_of("#f80"), color_of("#ff8800"));
  EXPECT_EQ(color_of("#F80c"), color_of("#ff8800cc"));
  EXPECT_EQ(color_of("#fff"), Eigen::Vector4f(1, 1, 1, 1));
  for (const char* wrong : {"#ff", "#fffff", "#ggg", "fff", "#+ff", "# ff"}) {
    const std::string errors = load_errors(R"({"materials": [{"color": ")" + std::string(wrong) + "\"}]}");
    EXPECT_NE(errors.find("#rgb"), std::string::npos) << wrong << errors;
  }
}

}  // namespace
}  // namespace offstage::producer
