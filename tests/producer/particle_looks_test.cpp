// Looks of particles with pictures and meshes: the data that the renderer gets, and the refused scenes.

#include <cmath>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "producer/build/picture.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "render/image_io.h"
#include "tests/render/gltf_samples.h"
#include "tests/render/scratch.h"

namespace offstage::producer {
namespace {

struct PictureFolder : render::ScratchFolder {
  PictureFolder() {
    render::Image image{8, 4, std::vector<uint8_t>(8 * 4 * 4, 255)};
    render::write_png(path() / "a.png", image);
  }
};

std::string look_scene(const std::string& look) {
  return R"({"world": {"seed": 5}, "emitters": [{"name": "e", "rate": 40, "lifespan": 9, "look": )" + look +
         R"(}], "output": {"fps": 10, "duration": 1.1}})";
}

/// Problems and warnings of a scene, one a line.
std::string findings(const std::string& look, const PictureFolder& folder) {
  std::string text;
  try {
    const LoadedScene loaded = parse_scene(look_scene(look), "scene", folder.path());
    std::vector<Problem> warnings = loaded.warnings;
    const ModelLibrary models(loaded.scene, loaded.folder, {}, warnings);
    for (const Problem& warning : warnings) text += warning.where.path + ": " + warning.what + "\n";
  } catch (const SceneError& error) {
    text = error.what();
  }
  return text;
}

TEST(ParticleLooks, EachParticleTurnsAtARateOfItsOwn) {
  const PictureFolder folder;
  const LoadedScene loaded = parse_scene(
      look_scene(
          R"({"texture": "a.png", "angle_deg": {"range": [10, 20]}, "spin_deg_per_s": {"range": [-90, 90]}})"),
      "scene", folder.path());
  std::vector<Problem> warnings;
  const ModelLibrary models(loaded.scene, loaded.folder, {}, warnings);
  Simulation simulation(loaded.scene, models);
  std::map<uint64_t, std::pair<float, float>> first;  // age and angle
  float slowest = 10, fastest = -10;
  for (int frame = 0; frame < loaded.scene.frame_count(); ++frame) {
    simulation.advance();
    const PointSet set = simulation.snapshot().point_sets.at(0);
    ASSERT_EQ(set.spins.size(), set.points.size());
    for (std::size_t i = 0; i < set.points.size(); ++i) {
      const render::Point& p = set.points[i];
      const float start = p.angle - set.spins[i] * set.ages[i], degree = std::numbers::pi_v<float> / 180;
      EXPECT_GT(start, 10 * degree - 1e-4f);
      EXPECT_LT(start, 20 * degree + 1e-4f);
      const auto [known, is_new] = first.try_emplace(p.id, set.ages[i], p.angle);
      EXPECT_NEAR(p.angle - known->second.second, set.spins[i] * (set.ages[i] - known->second.first), 1e-4f);
      slowest = std::min(slowest, set.spins[i]);
      fastest = std::max(fastest, set.spins[i]);
    }
  }
  EXPECT_GT(first.size(), 30u);
  EXPECT_LT(slowest, -1) << "rates spread over the whole range of -1.57 to 1.57 rad/s";
  EXPECT_GT(fastest, 1);
}

TEST(ParticleLooks, WithoutASpinASnapshotHasNone) {
  const PictureFolder folder;
  const LoadedScene loaded = parse_scene(look_scene(R"({"texture": "a.png"})"), "scene", folder.path());
  std::vector<Problem> warnings;
  const ModelLibrary models(loaded.scene, loaded.folder, {}, warnings);
  Simulation simulation(loaded.scene, models);
  for (int frame = 0; frame < 5; ++frame) simulation.advance();
  EXPECT_FALSE(simulation.snapshot().point_sets.at(0).points.empty());
  EXPECT_TRUE(simulation.snapshot().point_sets.at(0).spins.empty());
}

TEST(ParticleLooks, KeysWithoutEffectAndImpossibleSheetsAreNamed) {
  const PictureFolder folder;
  const auto expect = [&](const std::string& look, const std::string& part) {
    EXPECT_NE(findings(look, folder).find(part), std::string::npos) << look << ": " << findings(look, folder);
  };
  expect(R"({"texture": "b.png"})", "there is no file");
  expect(R"({"style": "smoke", "texture": "a.png"})", "it is for sprites");
  expect(R"({"sheet": {"columns": 2}})", "there is none");
  expect(R"({"texture": "a.png", "sheet": {"columns": 3}})", "8x4 pixels cannot be divided into 3 columns");
  expect(R"({"texture": "a.png", "sheet": {"columns": 64, "rows": 64}})",
         "4096 pictures (columns x rows); a sheet has at most 1024");
  expect(R"({"style": "sphere", "spin_deg_per_s": 10})", "has no effect");
  expect(R"({"style": "mesh"})", "needs an object to draw");
  expect(R"({"style": "mesh", "mesh": {"shape": {"type": "plane"}}})", "a plane is infinite");
  expect(R"({"style": "mesh", "mesh": {"shape": {"type": "box"}, "material": "oak"}})",
         "there is no material 'oak'");
  expect(R"({"style": "mesh", "color": "#f00", "mesh": {"shape": {"type": "box"}}})",
         "colour of its material");
  EXPECT_EQ(
      findings(R"({"texture": "a.png", "sheet": {"columns": 4, "rows": 2}, "spin_deg_per_s": 10})", folder),
      "");
  EXPECT_EQ(
      findings(R"({"style": "mesh", "mesh": {"shape": {"type": "box"}}, "spin_deg_per_s": 90})", folder), "");
}

// A glowing square of 2 m, whose corners are brought to the ball of each particle: its side becomes sqrt(2)
// radii.
TEST(ParticleLooks, MeshesOfAFileFillTheBallOfEachParticle) {
  render::GltfSample square;
  square.pbr()["baseColorFactor"] = {0, 0, 0, 1};
  square.material()["emissiveFactor"] = {1, 0, 0};
  const PictureFolder folder;
  folder.put("square.gltf", square.text());
  const LoadedScene loaded = parse_scene(
      R"({"particles": [{"radius": 0.5, "gravity": false, "places": [{"position": [-1, 0, 0]}, {"position": [1, 0.5, 0]}],
            "look": {"style": "mesh", "mesh": {"shape": {"type": "mesh", "file": "square.gltf"}}}}],
          "camera": {"type": "static", "eye": [0, 0, 5], "target": [0, 0, 0], "fov_deg": 40},
          "environment": {"intensity": 0}, "lights": [{"type": "sun", "intensity": 0}],
          "render": {"size": [96, 96], "bloom": 0}, "output": {"fps": 10, "duration": 1.1}})",
      "scene", folder.path());
  std::vector<Problem> warnings;
  const ModelLibrary models(loaded.scene, loaded.folder, {}, warnings);
  Simulation simulation(loaded.scene, models);
  render::Context context;
  Picture picture(loaded.scene, models, context);
  const Snapshot state = simulation.snapshot();
  picture.draw(state, state);
  const render::HdrImage image = picture.linear();
  const auto red_at = [&](double x, double y) {
    const double pixels_per_m = 48 / (5 * std::tan(20 * std::numbers::pi / 180));
    const auto column = static_cast<std::size_t>(48 + x * pixels_per_m),
               row = static_cast<std::size_t>(48 - y * pixels_per_m);
    return image.rgba[4 * (96 * row + column)];
  };
  for (const auto& [x, y] : {std::pair(-1.0, 0.0), {1.0, 0.5}}) {
    EXPECT_GT(red_at(x, y), 0.9f);
    EXPECT_GT(red_at(x + 0.3, y - 0.3), 0.9f);
    EXPECT_LT(red_at(x + 0.41, y), 0.1f) << "beside the square, within the ball";
    EXPECT_LT(red_at(x, y - 0.41), 0.1f);
  }
}

TEST(ParticleGroups, TakeThePointsOfAFile) {
  const PictureFolder folder;
  folder.put("cloud.obj", "v 0 0 0 1 0 0\nv 10 0 0 0 1 0\nv 0 20 0 0 0 1\nv 0 0 1 1 1 1\n");
  const LoadedScene loaded = parse_scene(
      R"({"particles": [{"name": "p", "file": "cloud.obj", "fit": [1, 1, 1], "position": [0, 3, 0],
                      "places": [{"position": [9, 9, 9]}]}]})",
      "scene", folder.path());
  const std::vector<ParticlePlace>& places = loaded.scene.particles[0].places;
  ASSERT_EQ(places.size(), 5u);
  EXPECT_LT((places[3].position - Vec3(0, 4, 0)).norm(), 1e-6) << "20 units are 1 m";
  ASSERT_TRUE(places[3].color);
  EXPECT_EQ(places[3].color->rgba, Eigen::Vector4f(0, 0, 1, 1));
  EXPECT_FALSE(places[0].color);
}

}  // namespace
}  // namespace offstage::producer
