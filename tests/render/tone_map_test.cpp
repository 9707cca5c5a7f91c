#include "render/tone_map.h"

#include <cmath>

#include <gtest/gtest.h>

namespace offstage::render {
namespace {

HdrImage row_of(const std::vector<float>& greys) {
  HdrImage image{static_cast<int>(greys.size()), 1, {}};
  for (const float grey : greys) image.rgba.insert(image.rgba.end(), {grey, grey, grey, 1});
  return image;
}

double exact_srgb(double x) {
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

TEST(Srgb, EncodesByTheStandardAndDecodesBack) {
  EXPECT_FLOAT_EQ(srgb_encode(0.5f), 0.7353569831f);
  EXPECT_FLOAT_EQ(srgb_encode(0.001f), 0.01292f);
  for (int i = 0; i <= 255; ++i) {
    const float encoded = static_cast<float>(i) / 255;
    EXPECT_NEAR(srgb_encode(srgb_decode(encoded)), encoded, 1e-6);
  }
}

TEST(ToneMap, LinearCurveReturnsEveryDisplayableGrey) {
  std::vector<float> greys;
  for (int i = 0; i <= 255; ++i) greys.push_back(srgb_decode(static_cast<float>(i) / 255));
  const Image shown = tone_map(row_of(greys), {.curve = ToneCurve::linear, .dither = false});
  for (std::size_t i = 0; i < 256; ++i) EXPECT_EQ(shown.rgba[4 * i], i);
}

TEST(ToneMap, TableIsWithinAQuarterStepOfDoublePrecision) {
  // With dithering, the mean over many pixels has the table's value to less than one step.
  for (float x = 0.0004f; x < 0.99f; x *= 1.37f) {
    HdrImage image{64, 64, {}};
    for (int i = 0; i < 64 * 64; ++i) image.rgba.insert(image.rgba.end(), {x, x, x, 1});
    const Image shown = tone_map(image, {.curve = ToneCurve::linear});
    double mean = 0;
    for (std::size_t i = 0; i < shown.rgba.size(); i += 4) mean += shown.rgba[i] / 4096.0;
    EXPECT_NEAR(mean, 255 * exact_srgb(static_cast<double>(x)), 0.25) << x;
  }
}

TEST(ToneMap, DitherMovesNoPixelByMoreThanAStepAndKeepsBlackAndWhite) {
  HdrImage image{64, 3, {}};
  for (const float x : {0.0f, 0.3f, 1.0f}) {
    for (int i = 0; i < 64; ++i) image.rgba.insert(image.rgba.end(), {x, x, x, 1});
  }
  const Image shown = tone_map(image, {.curve = ToneCurve::linear});
  const double exact = 255 * exact_srgb(0.3);
  for (std::size_t i = 0; i < 64; ++i) {
    EXPECT_EQ(shown.rgba[4 * i], 0);
    EXPECT_NEAR(shown.rgba[4 * (64 + i)], exact, 1);
    EXPECT_EQ(shown.rgba[4 * (128 + i)], 255);
  }
}

TEST(ToneMap, FilmicCurveRisesAndKeepsHighlightsApart) {
  std::vector<float> greys;
  for (float x = 0.001f; x < 8; x *= 1.2f) greys.push_back(x);
  const Image shown = tone_map(row_of(greys), {.dither = false});
  for (std::size_t i = 4; i < shown.rgba.size(); i += 4) EXPECT_GE(shown.rgba[i], shown.rgba[i - 4]);
  const Image two = tone_map(row_of({1, 2}), {.dither = false});
  EXPECT_GT(two.rgba[4], two.rgba[0] + 15);
  EXPECT_LT(two.rgba[4], 250);
}

TEST(ToneMap, ExposureAndSampleWeightScaleTheLight) {
  const HdrImage image = row_of({0.8f});
  const Image expected = tone_map(row_of({0.2f}), {.dither = false});
  EXPECT_EQ(tone_map(image, {.exposure = 0.25f, .dither = false}).rgba, expected.rgba);
  HdrImage sum = image;
  sum.rgba[3] = 4;  // four sub-frames
  EXPECT_EQ(tone_map(sum, {.sample_weight = 0.25f, .dither = false}).rgba, expected.rgba);
}

TEST(ToneMap, GivesStraightAlpha) {
  const HdrImage half{1, 1, {0.25f, 0.1f, 0, 0.5f}};
  const HdrImage whole{1, 1, {0.5f, 0.2f, 0, 1}};
  const Image a = tone_map(half, {.dither = false}), b = tone_map(whole, {.dither = false});
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(a.rgba[c], b.rgba[c]);
  EXPECT_EQ(a.rgba[3], 128);
  EXPECT_EQ(tone_map({1, 1, {0, 0, 0, 0}}, {}).rgba, (std::vector<uint8_t>{0, 0, 0, 0}));
}

TEST(ToneMap, AddedLightOnATransparentBackgroundGetsAlpha) {
  const Image shown = tone_map({1, 1, {0.6f, 0.3f, 0, 0}}, {.curve = ToneCurve::linear, .dither = false});
  EXPECT_EQ(shown.rgba[0], 255);
  EXPECT_EQ(shown.rgba[3], 153);
}

TEST(ToneMap, TreatsNegativeAndInfiniteLightAsBlackAndWhite) {
  const Image shown = tone_map(row_of({-1, std::numeric_limits<float>::infinity()}), {});
  EXPECT_EQ(shown.rgba[0], 0);
  EXPECT_EQ(shown.rgba[4], 255);
}

Image slanted_edge() {
  Image image{64, 64, {}};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const uint8_t v = x > 12 + y / 4 ? 220 : 20;
      image.rgba.insert(image.rgba.end(), {v, v, v, 255});
    }
  }
  return image;
}

TEST(FilterEdges, SmoothsTheStepsOfASlantedEdge) {
  const Image sharp = slanted_edge();
  Image smooth = sharp;
  filter_edges(smooth);
  // The error relative to the exact coverage falls by at least a third.
  const auto error = [](const Image& image) {
    double sum = 0;
    for (int y = 8; y < 56; ++y) {
      for (int x = 8; x < 40; ++x) {
        const double edge = 13 + (y - 1.5) / 4;  // the mean line through the steps
        const double coverage = std::clamp(x + 1 - edge, 0.0, 1.0);
        sum += std::abs(image.rgba[static_cast<std::size_t>(4 * (y * 64 + x))] - (20 + 200 * coverage));
      }
    }
    return sum;
  };
  EXPECT_LT(error(smooth), 0.67 * error(sharp));
}

TEST(FilterEdges, DoesNotChangeFlatAndGentlyShadedAreas) {
  Image image{32, 32, {}};
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      const auto v = static_cast<uint8_t>(60 + 3 * x + 2 * y);
      image.rgba.insert(image.rgba.end(), {v, v, v, 255});
    }
  }
  const Image before = image;
  filter_edges(image);
  EXPECT_EQ(image.rgba, before.rgba);
}

TEST(FilterEdges, WorksAtTheBordersAndOnTheSmallestPictures) {
  for (const int size : {1, 2, 3}) {
    Image image{size, size, {}};
    for (int i = 0; i < size * size; ++i) {
      const uint8_t v = i % 2 == 0 ? 255 : 0;
      image.rgba.insert(image.rgba.end(), {v, v, v, 255});
    }
    filter_edges(image);
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) EXPECT_EQ(image.rgba[i], 255);
  }
  Image empty;
  filter_edges(empty);
  EXPECT_TRUE(empty.rgba.empty());
}

}  // namespace
}  // namespace offstage::render
