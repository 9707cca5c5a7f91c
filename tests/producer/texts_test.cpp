// Text overlays: content, position and time.

#include "producer/build/texts.h"

#include <gtest/gtest.h>

#include "producer/base/time_code.h"
#include "producer/run/contact_sheet.h"
#include "render/text.h"

namespace offstage::producer {
namespace {

constexpr int kWidth = 320, kHeight = 200;

render::Image grey() {
  return {kWidth, kHeight, std::vector<uint8_t>(std::size_t{4} * kWidth * kHeight, 128)};
}

/// Returns the picture of one text over grey at a given time.
render::Image shown(const TextOverlay& overlay, double time = 1.5) {
  Scene scene;
  scene.overlays.push_back(overlay);
  Snapshot moment;
  moment.frame = 46;
  moment.time = time;
  moment.bodies.resize(3);
  moment.point_sets.resize(2);
  moment.point_sets[1].points.resize(17);
  render::Image image = grey();
  write_texts(scene, moment, image);
  return image;
}

/// Bounds of the pixels that differ from grey: left, top, right and bottom (the last two exclusive).
std::array<int, 4> text_box(const render::Image& image) {
  std::array<int, 4> box = {kWidth, kHeight, 0, 0};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (image.rgba[static_cast<std::size_t>(4 * (y * kWidth + x))] != 128)
        box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x + 1), std::max(box[3], y + 1)};
  return box;
}

TEST(Texts, PlaceholdersStandForTheMoment) {
  const render::Image by_name = shown({.text = "{time} {frame} {bodies} {particles}"});
  EXPECT_EQ(by_name.rgba, shown({.text = time_code(1.5) + " 46 3 17"}).rgba);
  EXPECT_NE(by_name.rgba, shown({.text = time_code(1.5) + " 46 3 18"}).rgba);
  EXPECT_NE(by_name.rgba, grey().rgba);
}

TEST(Texts, StandAtTheirPlace) {
  const auto box = [](TextPlace place) { return text_box(shown({.text = "Here", .place = place})); };
  const auto [left, top, right, bottom] = box(TextPlace::top_left);
  EXPECT_LT(right, kWidth / 2);
  EXPECT_LT(bottom, kHeight / 2);
  const auto corner = box(TextPlace::bottom_right);
  // The distances from the other sides are equal, up to the space below and beside the letters.
  EXPECT_NEAR(kWidth - corner[2], left, 4);
  EXPECT_NEAR(kHeight - corner[3], top, 6);
  const auto center = box(TextPlace::center);
  EXPECT_NEAR(center[0] + center[2], kWidth, 4);
  EXPECT_NEAR(center[1] + center[3], kHeight, 8);
}

TEST(Texts, LinesAreOneBelowTheOtherAndGrowWithTheirSize) {
  const auto height = [](const TextOverlay& overlay) {
    const auto box = text_box(shown(overlay));
    return box[3] - box[1];
  };
  const int one = height({.text = "HH", .size = 0.05}), two = height({.text = "HH\nHH", .size = 0.05});
  EXPECT_EQ(two - one, render::kTextHeight_px + 3);
  EXPECT_NEAR(height({.text = "HH", .size = 0.1}), 2 * one, 2);
}

TEST(Texts, ALongLineIsSmallerSoThatItFits) {
  const auto box = text_box(shown({.text = std::string(20, 'H'), .size = 0.2}));
  EXPECT_GT(box[0], 0);
  EXPECT_LT(box[2], kWidth);
  EXPECT_GT(box[2] - box[0], kWidth / 2);
}

TEST(Texts, AreVisibleOnlyInTheirTime) {
  const TextOverlay overlay{.text = "now", .from = 1, .until = 2};
  EXPECT_EQ(shown(overlay, 0.99).rgba, grey().rgba);
  EXPECT_NE(shown(overlay, 1).rgba, grey().rgba);
  EXPECT_EQ(shown(overlay, 2).rgba, grey().rgba);
}

}  // namespace
}  // namespace offstage::producer
