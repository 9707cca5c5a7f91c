// Channels as PNG have the encoding stated in their comments. The reader keeps only the upper byte of 16
// bits.

#include <limits>

#include <gtest/gtest.h>

#include "render/channels.h"
#include "render/image_io.h"

namespace offstage::render {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

/// Returns the channels of four pixels in a row. The last pixel shows no object.
Channels sample() {
  return {.width_px = 4,
          .height_px = 1,
          .depth = {0.256f, 25.6f, 65.6f, kNothing},
          .normal = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, 0}},
          .id = {1, 2, 16'000'000, 0},
          .motion = {{4, 0}, {-8, 511}, {-600, 600}, {0, 0}}};
}

Image png_of(Channel channel) {
  return decode_image(channel_png(sample(), channel, {{2, "the box"}}), "channel");
}

std::vector<int> pixel(const Image& image, std::size_t x) {
  return {image.rgba[4 * x], image.rgba[4 * x + 1], image.rgba[4 * x + 2]};
}

TEST(ChannelPng, DepthIsInMillimetresAndZeroBeyond) {
  const Image image = png_of(Channel::depth);
  EXPECT_EQ(pixel(image, 0)[0], 1);
  EXPECT_EQ(pixel(image, 1)[0], 100);
  EXPECT_EQ(pixel(image, 2)[0], 0) << "more than 65.535 m";
  EXPECT_EQ(pixel(image, 3)[0], 0);
}

TEST(ChannelPng, NormalsFillTheWholeRange) {
  const Image image = png_of(Channel::normal);
  EXPECT_EQ(pixel(image, 0), (std::vector{255, 128, 128}));
  EXPECT_EQ(pixel(image, 1), (std::vector{128, 0, 128}));
  EXPECT_EQ(pixel(image, 3), (std::vector{0, 0, 0}));
}

TEST(ChannelPng, MotionIsInSixtyFourthsOfAPixel) {
  const Image image = png_of(Channel::motion);
  EXPECT_EQ(pixel(image, 0)[0], 129);
  EXPECT_EQ(pixel(image, 0)[1], 128);
  EXPECT_EQ(pixel(image, 1)[0], 126);
  EXPECT_EQ(pixel(image, 1)[1], 255);
  EXPECT_EQ(pixel(image, 2), (std::vector{0, 255, 0})) << "motion is limited to the range of the numbers";
}

TEST(ChannelPng, AColourGivesBackItsId) {
  const Image image = png_of(Channel::id);
  const Channels c = sample();
  for (std::size_t x = 0; x < 4; ++x) {
    const std::vector<int> p = pixel(image, x);
    const auto number = static_cast<uint32_t>(p[0] << 16 | p[1] << 8 | p[2]);
    EXPECT_EQ(number * 0xB382C9 & 0xFFFFFF, c.id[x]);
  }
  const std::vector<uint8_t> bytes = channel_png(c, Channel::id, {{2, "the box"}});
  EXPECT_NE(std::string(bytes.begin(), bytes.end()).find("2 #3c6ef2 the box\n"), std::string::npos);
}

TEST(ChannelFiles, AreNamedAfterTheFrame) {
  EXPECT_EQ(channel_files("a/shot.2.0001", {{Channel::id, Channel::depth}}),
            std::vector<std::filesystem::path>{"a/shot.2.0001.exr"});
  EXPECT_EQ(channel_files("a/0001", {{Channel::id, Channel::depth}, ChannelFormat::png}),
            (std::vector<std::filesystem::path>{"a/0001.id.png", "a/0001.depth.png"}));
  EXPECT_TRUE(channel_files("a/0001", {}).empty());
}

}  // namespace
}  // namespace offstage::render
