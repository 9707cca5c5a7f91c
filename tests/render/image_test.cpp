#include "render/image.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace offstage::render {
namespace {

Image grey(int width_px, int height_px, uint8_t value = 100) {
  Image image{width_px, height_px, {}};
  image.rgba.assign(image.pixel_count() * 4, value);
  return image;
}

TEST(PixelHash, IsThirtyTwoDigitsAndSeesEveryPixelAndTheShape) {
  const Image image = grey(6, 4);
  const std::string hash = pixel_hash(image);
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(hash.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_EQ(hash, pixel_hash(grey(6, 4)));
  EXPECT_NE(hash, pixel_hash(grey(4, 6)));
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    Image changed = image;
    changed.rgba[i] ^= 1;
    ASSERT_NE(pixel_hash(changed), hash);
  }
}

TEST(ImageDifference, CountsAndSums) {
  const Image a = grey(10, 10);
  Image b = a;
  b.rgba[0] = 102;   // a difference of two: within the threshold
  b.rgba[41] = 103;  // a difference of three
  b.rgba[43] = 90;   // another channel of the same pixel
  const ImageDifference d = difference(a, b);
  EXPECT_EQ(d.max_delta, 10);
  EXPECT_EQ(d.pixels_over, 1u);
  EXPECT_DOUBLE_EQ(d.fraction_over, 0.01);
  EXPECT_DOUBLE_EQ(d.total_delta, 15);
  EXPECT_DOUBLE_EQ(d.mean_delta, 15.0 / 400);
  EXPECT_FALSE(d.within_tolerance());
  EXPECT_TRUE(difference(a, a).within_tolerance());
}

TEST(ImageDifference, ToleranceHasBothBounds) {
  const Image a = grey(100, 100);
  Image few = a;
  for (std::size_t i = 0; i < 5; ++i) few.rgba[4 * i] = 255;  // 0.05 % of the pixels, with a large difference
  EXPECT_TRUE(difference(a, few).within_tolerance());
  few.rgba[40] = 255;
  EXPECT_FALSE(difference(a, few).within_tolerance());
  EXPECT_FALSE(difference(a, grey(100, 100, 101)).within_tolerance());  // all pixels, with a small difference
}

TEST(ImageDifference, RefusesDifferentSizes) {
  EXPECT_THROW(difference(grey(2, 3), grey(3, 2)), std::invalid_argument);
  EXPECT_THROW(amplified_difference(grey(2, 3), grey(3, 2)), std::invalid_argument);
}

TEST(ImageDifference, AmplifiedIsOpaqueAndClamped) {
  const Image a = grey(2, 1);
  Image b = a;
  b.rgba[0] = 103;
  b.rgba[1] = 0;
  const Image shown = amplified_difference(a, b, 16);
  EXPECT_EQ(shown.rgba, (std::vector<uint8_t>{48, 255, 0, 255, 0, 0, 0, 255}));
}

}  // namespace
}  // namespace offstage::render
