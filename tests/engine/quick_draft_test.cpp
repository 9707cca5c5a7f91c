#include <gtest/gtest.h>

#include "producer/build/picture.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "render/context.h"

namespace offstage::engine {
namespace {

/// The first frame of a scene, drawn in two ways: quickly, as the tuning page does, and as `render --quality
/// draft` does.
struct Drafts {
  explicit Drafts(const std::string& objects) {
    const std::string text = "{" + objects + R"(, "render": {"size": [160, 90], "quality": "draft"},
      "output": {"fps": 10, "duration": 0.1}})";
    const producer::LoadedScene loaded = producer::parse_scene(text, "drafts", "");
    const producer::ModelLibrary models;
    producer::Simulation simulation(loaded.scene, models);
    while (simulation.frame() < 1) simulation.advance();
    const producer::Snapshot state = simulation.snapshot();
    render::Context context;
    for (const bool is_quick : {false, true}) {
      producer::Picture picture(loaded.scene, models, context, is_quick);
      picture.draw(state, state);
      (is_quick ? quick : exact) = picture.linear();
    }
  }
  static float brightness(const render::HdrImage& image, std::size_t pixel) {
    return image.rgba[4 * pixel] + image.rgba[4 * pixel + 1] + image.rgba[4 * pixel + 2];
  }
  /// Returns the mean difference of all pixels, as a fraction of the mean brightness.
  double mean_difference() const {
    double difference = 0, total = 0;
    for (std::size_t i = 0; i < exact.pixel_count(); ++i) {
      difference += std::abs(double{brightness(quick, i)} - double{brightness(exact, i)});
      total += double{brightness(exact, i)};
    }
    return difference / total;
  }
  /// Returns the fraction of the pixels that differ by more than a factor of two.
  double fraction_of_wrong() const {
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < exact.pixel_count(); ++i) {
      const float a = brightness(quick, i), b = brightness(exact, i);
      wrong += std::max(a, b) > 2 * std::min(a, b) ? 1 : 0;
    }
    return static_cast<double>(wrong) / static_cast<double>(exact.pixel_count());
  }
  render::HdrImage exact, quick;
};

// A quick draft traces indirect light for a sixteenth of the pixels, and the light of the sun for half of
// them. Edges of shadows may therefore be wrong by a pixel, and the noise differs.
TEST(EnginesQuickDrafts, LookLikeDraftsOfRender) {
  const Drafts drafts(
      R"("materials": [{"name": "tiles", "pattern": "checker"}, {"name": "lamp", "emission": [3, 2, 1]},
      {"name": "chrome", "metallic": 1, "roughness": 0.1}, {"name": "rough", "metallic": 1, "roughness": 0.6}],
    "bodies": [{"motion": "static", "shape": {"type": "plane"}, "material": "tiles"},
      {"motion": "static", "position": [-1.2, 0.5, 0], "shape": {"type": "sphere", "radius": 0.5}, "material": "chrome"},
      {"motion": "static", "position": [0, 0.5, 0], "shape": {"type": "box", "size": [0.6, 1, 0.6]}},
      {"motion": "static", "position": [1.2, 0.5, 0], "shape": {"type": "sphere", "radius": 0.5}, "material": "rough"},
      {"motion": "static", "position": [0, 1.6, -1], "shape": {"type": "sphere", "radius": 0.2}, "material": "lamp"}],
    "lights": [{"type": "sun"}, {"type": "point", "position": [1, 3, 2], "intensity": 10}],
    "environment": {"fog": 0.02}, "camera": {"eye": [0, 1.5, 5], "target": [0, 0.6, 0]})");
  EXPECT_LT(drafts.mean_difference(), 0.02);
  EXPECT_LT(drafts.fraction_of_wrong(), 0.005);
}

// A diagonal line crosses either only pixels with traced light, or only pixels with interpolated light.
TEST(EnginesQuickDrafts, LightThinLinesInAnyDirection) {
  for (const double x : {0.0, 0.0125, 0.025, 0.0375, 0.05}) {
    const Drafts drafts(
        R"("bodies": [{"motion": "static", "orientation": {"axis": [0, 0, 1], "angle_deg": 45},
        "position": [)" +
        std::to_string(x) + R"(, 1, 0], "shape": {"type": "capsule", "radius": 0.008, "height": 3}}],
      "lights": [{"type": "sun", "direction": [0, 0.3, 1]}], "camera": {"eye": [0, 1, 4], "target": [0, 1, 0]})");
    EXPECT_LT(drafts.fraction_of_wrong(), 0.001) << "at " << x;
  }
}

}  // namespace
}  // namespace offstage::engine
