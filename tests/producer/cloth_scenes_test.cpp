/// Simulates ten seconds of every scene of the gallery with cloth: no object is inside of another one, and no
/// cloth crosses itself.

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "cloth_crossings.h"
#include "cloth_shadow.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "sim/collision/distance.h"

namespace offstage::producer {
namespace {

/// Returns the scenes with the key `cloths`. Their text is searched, because every start of this program
/// lists them, and loading all scenes takes 0.2 s.
std::vector<std::string> scenes_with_cloths() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(OFFSTAGE_SOURCE_DIR "/demos/scenes")) {
    if (entry.path().extension() != ".json") continue;
    std::ifstream file(entry.path());
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (text.find("\"cloths\":") != std::string::npos) names.push_back(entry.path().stem());
  }
  std::ranges::sort(names);
  return names;
}

/// Returns the number of cloth points that are behind the surface of a body. Rounding errors are tolerated,
/// because cords end on surfaces. For meshes the statistics of the simulation are used.
std::size_t points_inside(const sim::World& world, const sim::ClothView& cloth) {
  std::size_t count = 0;
  world.for_each_body([&](sim::BodyHandle handle) {
    const sim::BodyDef& def = world.body_def(handle);
    if (!def.collides || std::holds_alternative<sim::MeshShape>(def.shape)) return;
    const sim::Pose pose = world.body(handle).pose;
    for (const sim::Vec3& p : cloth.points)
      count += sim::signed_distance(sim::Solid{&def.shape, nullptr}, pose.point_to_body(p)).distance < -1e-12;
  });
  return count;
}

/// Returns the number of pairs of triangles that cross. All cloths with `self_collision` are treated as one
/// mesh.
std::size_t crossed_pairs(const Simulation& simulation) {
  std::vector<sim::Vec3> points;
  std::vector<sim::Triangle> triangles;
  std::vector<uint32_t> sources;
  for (const Simulation::NamedCloth& cloth : simulation.cloths()) {
    if (!simulation.world().cloth_def(cloth.handle).self_collision) continue;
    const sim::ClothView view = simulation.world().cloth(cloth.handle);
    const auto first = static_cast<uint32_t>(points.size());
    points.insert(points.end(), view.points.begin(), view.points.end());
    for (uint32_t source : view.sources) sources.push_back(first + source);
    for (const sim::Triangle& t : view.triangles)
      triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return sim::crossings({.points = points, .velocities = {}, .triangles = triangles, .sources = sources});
}

class LongClothScene : public ::testing::TestWithParam<std::string> {};

TEST_P(LongClothScene, KeepsClothOutOfBodiesAndOfItself) {
  LoadedScene loaded = load_scene(OFFSTAGE_SOURCE_DIR "/demos/scenes/" + GetParam() + ".json");
  ASSERT_FALSE(loaded.scene.cloths.empty());
  const ModelLibrary models(loaded.scene, loaded.folder, DecompositionCache(), loaded.warnings);
  Simulation simulation(loaded.scene, models);
  const int frames = static_cast<int>(10 * loaded.scene.output.fps.per_second());
  for (int i = 0; i < frames; ++i) {
    simulation.advance();
    std::size_t inside = 0;
    for (const Simulation::NamedCloth& cloth : simulation.cloths())
      inside += points_inside(simulation.world(), simulation.world().cloth(cloth.handle));
    ASSERT_EQ(inside, 0u) << "frame " << i;
    ASSERT_EQ(crossed_pairs(simulation), 0u) << "frame " << i;
  }
  EXPECT_LT(simulation.totals().cloth.penetration, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Long, LongClothScene, ::testing::ValuesIn(scenes_with_cloths()),
                         [](const auto& scene) { return scene.param; });

TEST(LongSwatches, HaveTheDrapeCoefficientsOfTheirCaption) {
  // (shadow - stand) / (flat - stand): 0 if the cloth hangs straight down from the rim of its stand, 1 if it
  // stays flat (Cusick, 1968).
  LoadedScene loaded = load_scene(OFFSTAGE_SOURCE_DIR "/demos/scenes/swatches.json");
  std::string caption;
  for (const Overlay& overlay : loaded.scene.overlays)
    if (const auto* text = std::get_if<TextOverlay>(&overlay)) caption += text->text + " ";
  const ModelLibrary models(loaded.scene, loaded.folder, DecompositionCache(), loaded.warnings);
  Simulation simulation(loaded.scene, models);
  const int frames = static_cast<int>(loaded.scene.output.duration * loaded.scene.output.fps.per_second());
  for (int i = 0; i < frames; ++i) simulation.advance();
  const double stand = std::numbers::pi * 0.09 * 0.09, flat = std::numbers::pi * 0.15 * 0.15;
  double before = 0;
  std::size_t read = 0;
  for (const Simulation::NamedCloth& cloth : simulation.cloths()) {
    const sim::ClothView view = simulation.world().cloth(cloth.handle);
    sim::Vec3 centre = sim::Vec3::Zero();
    for (const Body& body : loaded.scene.bodies)
      if (body.name == "stand_" + cloth.name) centre = body.position;
    const double drape = 100 * (sim::shadow_area(view, centre) - stand) / (flat - stand);
    const std::size_t at = caption.find(cloth.name + " ");
    ASSERT_NE(at, std::string::npos) << cloth.name;
    EXPECT_NEAR(std::stod(caption.substr(at + cloth.name.size())), drape, 1) << cloth.name;
    EXPECT_GT(drape, before) << cloth.name;  // the fabrics are listed from the softest to the stiffest
    before = drape;
    ++read;
  }
  EXPECT_EQ(read, 5u);
}

}  // namespace
}  // namespace offstage::producer
