#include "render/tone_map.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace offstage::render {
namespace {

// A display curve as a table over the upper bits of a float: the exponent and kMantissaBits of the mantissa,
// with each entry computed at the centre of its cell. Entries are in 1/256 of an 8-bit step. At the steepest
// part of the sRGB curve the error is 0.11 steps. Below the first cell the display value is under 0.1 steps.
constexpr int kMantissaBits = 9;
constexpr int kShift = 23 - kMantissaBits;
constexpr int kFirstExponent = -15, kLastExponent = 7;
constexpr int kFirstCell = (127 + kFirstExponent) << kMantissaBits;
constexpr int kCellCount = (kLastExponent - kFirstExponent) << kMantissaBits;
constexpr int kStep = 256;

using Table = std::vector<uint16_t>;

// Rational fit of a film's response by K. Narkowicz, "ACES Filmic Tone Mapping Curve" (2015). The scale maps
// a sunlit white to 0.91, which leaves room for its reflections.
double filmic(double x) {
  constexpr double kScale = 0.4;
  x *= kScale;
  return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
}

double encode_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

Table make_table(ToneCurve curve) {
  Table table(kCellCount + 1, 0);
  for (int cell = 0; cell < kCellCount; ++cell) {
    const auto low = std::bit_cast<float>((cell + kFirstCell) << kShift);
    const auto high = std::bit_cast<float>((cell + kFirstCell + 1) << kShift);
    const double x = 0.5 * (static_cast<double>(low) + static_cast<double>(high));
    const double display = encode_srgb(std::clamp(curve == ToneCurve::filmic ? filmic(x) : x, 0.0, 1.0));
    table[static_cast<std::size_t>(cell) + 1] = static_cast<uint16_t>(std::lround(display * 255 * kStep));
  }
  return table;
}

const Table& table_of(ToneCurve curve) {
  static const Table filmic_table = make_table(ToneCurve::filmic);
  static const Table linear_table = make_table(ToneCurve::linear);
  return curve == ToneCurve::filmic ? filmic_table : linear_table;
}

// Negative numbers have the sign bit set. They map to the first entry of the table, which is black.
inline uint32_t look_up(const uint16_t* table, float value) {
  const int cell = (std::bit_cast<int32_t>(value) >> kShift) - kFirstCell + 1;
  return table[std::clamp(cell, 0, kCellCount)];
}

// Returns a dither threshold in [0, kStep). It is the R2 sequence of M. Roberts, folded to a triangle wave.
// This is close to blue noise and needs no table.
inline uint32_t dither_threshold(uint32_t x, uint32_t y) {
  const uint32_t phase = x * 3242174889u + y * 2447445413u;
  const uint32_t folded = phase ^ (phase & 0x80000000u ? 0xFFFFFFFFu : 0u);
  return folded >> 23;
}

inline uint8_t quantize(uint32_t value, uint32_t threshold) {
  return static_cast<uint8_t>((value + threshold) / kStep);
}

}  // namespace

float srgb_encode(float linear) {
  return static_cast<float>(encode_srgb(static_cast<double>(linear)));
}

float srgb_decode(float encoded) {
  const double x = encoded;
  return static_cast<float>(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
}

float metered_exposure(const HdrImage& sum, float sample_weight) {
  constexpr double kGrey = 0.5, kDarkest = 1e-3, kMost = 16;
  double logarithms = 0;
  std::size_t pixels = 0;
  // Every third pixel in each direction is enough for the measurement.
  for (int y = 0; y < sum.height_px; y += 3) {
    for (int x = 0; x < sum.width_px; x += 3, ++pixels) {
      const float* p =
          sum.rgba.data() + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(sum.width_px) +
                                 static_cast<std::size_t>(x));
      const float luminance = sample_weight * (0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2]);
      logarithms += std::log(std::max(static_cast<double>(luminance), kDarkest));
    }
  }
  if (pixels == 0) return 1;
  const double mean = std::exp(logarithms / static_cast<double>(pixels));
  return static_cast<float>(std::clamp(kGrey / mean, 1 / kMost, kMost));
}

Image tone_map(const HdrImage& sum, const ToneMap& options) {
  constexpr float kOpaque = 0.9999f;  // not exactly 1, because of rounding errors in the mean of N values
  Image image{sum.width_px, sum.height_px, std::vector<uint8_t>(sum.rgba.size()), sum.transparent};
  const uint16_t* table = table_of(options.curve).data();
  const float weight = options.sample_weight;
  const float gain = options.exposure * weight;
  const float* in = sum.rgba.data();
  uint8_t* out = image.rgba.data();
  for (uint32_t y = 0; y < static_cast<uint32_t>(sum.height_px); ++y) {
    for (uint32_t x = 0; x < static_cast<uint32_t>(sum.width_px); ++x, in += 4, out += 4) {
      float alpha = in[3] * weight;
      float scale = gain;
      if (alpha < kOpaque) {
        // Added light covers nothing, but a picture with straight alpha can only show light where it covers.
        alpha = std::max(alpha, std::min(1.0f, gain * std::max({in[0], in[1], in[2]})));
        scale = alpha > 0 ? gain / alpha : 0;
      }
      const uint32_t threshold = options.dither ? dither_threshold(x, y) : kStep / 2;
      out[0] = quantize(look_up(table, in[0] * scale), threshold);
      out[1] = quantize(look_up(table, in[1] * scale), threshold);
      out[2] = quantize(look_up(table, in[2] * scale), threshold);
      out[3] = static_cast<uint8_t>(std::clamp(alpha, 0.0f, 1.0f) * 255 + 0.5f);
    }
  }
  return image;
}

}  // namespace offstage::render
