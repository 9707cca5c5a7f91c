// Cameras and lights of glTF files: their places, their pictures, and refused uses.

#include <cmath>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "producer/build/camera.h"
#include "producer/build/lights.h"
#include "producer/build/picture.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "tests/render/gltf_samples.h"
#include "tests/render/scratch.h"

namespace offstage::producer {
namespace {

using Eigen::Vector3f;
using render::Json;

constexpr float kPi = std::numbers::pi_v<float>;

/// A white square of 2 m that faces +Z, a camera 5 m before it that is rolled by 90 degrees, and a light 2 m
/// before it. The animation moves both by 1 m along +X in 2 s.
struct Room : render::GltfSample {
  Room() {
    pbr() = {{"metallicFactor", 0}, {"roughnessFactor", 1}};
    const double half = std::sqrt(0.5);
    document["scenes"][0]["nodes"] = {0, 1, 2};
    document["nodes"].push_back(
        {{"name", "Eye"}, {"camera", 0}, {"translation", {0, 0, 5}}, {"rotation", {0, 0, half, half}}});
    document["nodes"].push_back({{"name", "Bulb"},
                                 {"translation", {0, 0, 2}},
                                 {"scale", {3, 3, 3}},
                                 {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    document["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}}};
    document["extensionsUsed"] = {"KHR_lights_punctual"};
    light() = {{"type", "point"}, {"color", {1, 0.5, 0.25}}, {"intensity", 8}};
  }
  Json& light() { return document["extensions"]["KHR_lights_punctual"]["lights"][0]; }
  void animate() {
    const int times = accessor(std::vector<float>{0, 2}, "SCALAR");
    const int of_eye = accessor(std::vector<float>{0, 0, 5, 1, 0, 5}, "VEC3");
    const int of_bulb = accessor(std::vector<float>{0, 0, 2, 1, 0, 2}, "VEC3");
    document["animations"] = {
        {{"samplers", {{{"input", times}, {"output", of_eye}}, {{"input", times}, {"output", of_bulb}}}},
         {"channels",
          {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "translation"}}}},
           {{"sampler", 1}, {"target", {{"node", 2}, {"path", "translation"}}}}}}}};
  }
};

/// Returns a scene whose only body shows the room.
std::string scene_of(const std::string& more, const std::string& body = "") {
  return R"({"bodies": [{"name": "room", "motion": "static", "collides": false,
      "shape": {"type": "box", "size": [0.01, 0.01, 0.01]}, "model": {"file": "room.gltf"})" +
         body + R"(}], "environment": {"intensity": 0}, "render": {"size": [96, 96], "bloom": 0},
      "output": {"fps": 10, "duration": 1.1})" +
         more + "}";
}

const std::string kBoth =
    R"(, "camera": {"type": "model", "body": "room"}, "lights": [{"type": "model", "body": "room"}])";

Eigen::Vector4f pixel(const render::HdrImage& image, int x, int y) {
  return Eigen::Map<const Eigen::Vector4f>(&image.rgba[4 * static_cast<std::size_t>(y * image.width_px + x)]);
}

struct LoadedRoom {
  LoadedRoom(const Room& room, const std::string& text)
      : loaded(parse_scene(text, "scene", (folder.put("room.gltf", room.text()), folder.path()))),
        models(loaded.scene, loaded.folder, {}, warnings),
        simulation(loaded.scene, models) {}
  render::Camera camera_at(double time) { return CameraRig(loaded.scene, models).at(time, places(), {}); }
  std::vector<render::Lamp> lamps_at(double time) {
    return lamps_of(loaded.scene, models, time, places(), {});
  }
  BodyPlaces places() const { return BodyPlaces(ObjectTable(loaded.scene)); }
  render::HdrImage draw() {
    static render::Context context;
    Picture picture(loaded.scene, models, context);
    const Snapshot state = simulation.snapshot();
    picture.draw(state, state);
    return picture.linear();
  }
  render::ScratchFolder folder;
  std::vector<Problem> warnings;
  LoadedScene loaded;
  ModelLibrary models;
  Simulation simulation;
};

std::string problem_of(const Room& room, const std::string& text) {
  try {
    const LoadedRoom loaded(room, text);
  } catch (const SceneError& error) {
    return error.problems().front().where.path + ": " + error.problems().front().what;
  }
  return "";
}

TEST(ModelCamera, HasThePoseOfItsNodeInTheBodyAndTheFilesFieldOfView) {
  LoadedRoom room(
      Room(),
      scene_of(kBoth, R"(, "position": [10, 0, 0], "orientation": {"axis": [0, 1, 0], "angle_deg": 90})"));
  const render::Camera camera = room.camera_at(0);
  EXPECT_NEAR((camera.eye - Vector3f(15, 0, 0)).norm(), 0, 1e-4f) << "+Z of the file is +X";
  EXPECT_NEAR(((camera.target - camera.eye).normalized() - Vector3f(-1, 0, 0)).norm(), 0, 1e-5f);
  // The node is turned by 90 degrees about its z axis: its y axis is -X of the file, and so +Z of the scene.
  EXPECT_NEAR((camera.up - Vector3f(0, 0, 1)).norm(), 0, 1e-5f);
  EXPECT_NEAR(camera.fov_deg, 0.5f * 180 / kPi, 1e-3f);
}

// White plaster, 1 cd at a distance r, seen and lit along its normal: 1 / (pi r^2).
TEST(ModelLightPicture, OfOneCandelaGivesAWhiteSurfaceItsLuminance) {
  Room room;
  room.light()["intensity"] = 200;
  LoadedRoom loaded(room, scene_of(kBoth));
  const render::HdrImage picture = loaded.draw();
  const Vector3f expected = 200 / (kPi * 4) * Vector3f(1, 0.5f, 0.25f);
  const Vector3f middle = pixel(picture, 48, 48).head<3>();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(middle[k] / expected[k], 1, 0.05f) << middle.transpose();
}

// The camera is rolled: the file's -X is up in the picture. The square ends where its edges are seen.
TEST(ModelLightPicture, IsThatOfTheFilesCamera) {
  Room room;
  room.light()["intensity"] = 1000;
  room.set("POSITION", std::vector<float>{-1, -1, 0, 0.5f, -1, 0, 0.5f, 1, 0, -1, 1, 0}, "VEC3");
  LoadedRoom loaded(room, scene_of(kBoth));
  const render::HdrImage picture = loaded.draw();
  const float half = 48 / (5 * std::tan(0.25f));  // pixels per metre at the square
  const auto light_at = [&](float up_px) { return pixel(picture, 48, static_cast<int>(48 - up_px)).x(); };
  EXPECT_GT(light_at(half - 3), 1);
  EXPECT_LT(light_at(half + 3), 0.01f) << "the upper edge is at x = -1";
  EXPECT_GT(light_at(-0.5f * half + 3), 1);
  EXPECT_LT(light_at(-0.5f * half - 3), 0.01f) << "the lower one at x = 0.5";
}

// The recommended form of KHR_lights_punctual: the square of (cos t - cos outer) / (cos inner - cos outer).
TEST(ModelLightPicture, SpotsFadeAsTheExtensionDefines) {
  Room room;
  const float inner = 0.1f, outer = 0.4f;
  room.light() = {
      {"type", "spot"}, {"intensity", 400}, {"spot", {{"innerConeAngle", inner}, {"outerConeAngle", outer}}}};
  LoadedRoom loaded(room, scene_of(kBoth));
  const render::HdrImage picture = loaded.draw();
  const float pixels_per_m = 48 / (5 * std::tan(0.25f));
  for (const float angle : {0.0f, 0.15f, 0.25f, 0.35f}) {
    const float x = 2 * std::tan(angle), fall = std::cos(angle),
                fraction =
                    std::clamp((fall - std::cos(outer)) / (std::cos(inner) - std::cos(outer)), 0.0f, 1.0f);
    const float expected = 400 / (kPi * 4) * fall * fall * fall * fraction * fraction;
    const float seen = pixel(picture, 48, static_cast<int>(48 - pixels_per_m * x)).x();
    EXPECT_NEAR(seen, expected, 0.06f * 400 / (kPi * 4)) << angle;
  }
}

TEST(ModelLight, DirectionalOnesAreTheSun) {
  Room room;
  room.light() = {{"type", "directional"}, {"intensity", 100}, {"color", {0.5, 1, 1}}};
  room.document["nodes"][2]["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // shines along -Y
  LoadedRoom loaded(room, scene_of(kBoth));
  const render::Sun sun = sun_of(loaded.loaded.scene, loaded.models);
  EXPECT_NEAR((sun.direction - Vector3f(0, 1, 0)).norm(), 0, 1e-5f);
  EXPECT_NEAR(sun.intensity, 100 / kPi, 1e-3f) << "lux";
  EXPECT_EQ(sun.color.x(), 0.5f);
  EXPECT_TRUE(loaded.lamps_at(0).empty());
}

TEST(ModelLight, AndCamerasFollowTheAnimationThatTheBodyPlays) {
  Room room;
  room.animate();
  LoadedRoom loaded(room, scene_of(kBoth, R"(, "animation": {"loop": false})"));
  for (const double time : {0.0, 1.0, 5.0}) {
    const auto x = static_cast<float>(std::min(0.5 * time, 1.0));
    EXPECT_NEAR(loaded.camera_at(time).eye.x(), x, 1e-5f) << time;
    EXPECT_NEAR(loaded.lamps_at(time).at(0).position.x(), x, 1e-5f) << time;
  }
}

TEST(ModelLight, UnusableLightsAndCamerasAreNamed) {
  Room room;
  const auto lights = [](const std::string& more) {
    return scene_of(R"(, "lights": [{"type": "model", "body": "room")" + more + "}]");
  };
  const auto camera = [](const std::string& more) {
    return scene_of(R"(, "camera": {"type": "model", "body": "room")" + more + "}");
  };
  EXPECT_EQ(problem_of(room, lights(R"(, "name": "Bulk")")),
            "/lights/0: room.gltf: has no light 'Bulk'; did you mean 'Bulb'?");
  EXPECT_NE(problem_of(room, camera(R"(, "name": "Nose")")).find("/camera: room.gltf: has no camera 'Nose'"),
            std::string::npos);
  EXPECT_NE(problem_of(room, camera(R"(, "fov_deg": 20)")).find("/camera/fov_deg: "), std::string::npos);
  EXPECT_NE(problem_of(room, camera(R"(, "aperture": 0.1)")).find("/camera/aperture: "), std::string::npos);
  EXPECT_NE(problem_of(room, scene_of(R"(, "camera": {"type": "model", "body": "roof"})"))
                .find("there is no body 'roof'"),
            std::string::npos);

  Room flat = room;
  flat.document["cameras"][0] = {{"type", "orthographic"},
                                 {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0}, {"zfar", 9}}}};
  EXPECT_NE(problem_of(flat, camera("")).find("'Eye' is orthographic"), std::string::npos);

  Room sun = room;
  sun.light() = {{"type", "directional"}};
  EXPECT_NE(problem_of(sun, lights("")).find("'Bulb' does not shine downwards"), std::string::npos)
      << "along -Z is level";
  sun.animate();
  sun.document["nodes"][2]["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  EXPECT_EQ(problem_of(sun, lights("")), "") << "at rest";
  const std::string playing =
      scene_of(R"(, "lights": [{"type": "model", "body": "room"}])", R"(, "animation": {})");
  EXPECT_NE(problem_of(sun, playing).find("'Bulb' moves"), std::string::npos);
  const std::string two = scene_of(R"(, "lights": [{"type": "sun"}, {"type": "model", "body": "room"}])");
  EXPECT_NE(problem_of(sun, two).find("is a second sun"), std::string::npos);
}

TEST(ModelLight, AndCamerasThatNothingUsesAreWarnedOf) {
  const LoadedRoom unused(Room(), scene_of("")), used(Room(), scene_of(kBoth));
  std::string text;
  for (const Problem& warning : unused.warnings) text += warning.what + "\n";
  EXPECT_NE(text.find("1 cameras are not used"), std::string::npos) << text;
  EXPECT_NE(text.find("1 lights are not used"), std::string::npos) << text;
  EXPECT_TRUE(used.warnings.empty());
  Room room;
  room.light()["range"] = 9;
  const LoadedRoom ended(room, scene_of(kBoth));
  ASSERT_EQ(ended.warnings.size(), 1u);
  EXPECT_NE(ended.warnings[0].what.find("the range of the light 'Bulb' is ignored"), std::string::npos);
}

}  // namespace
}  // namespace offstage::producer
