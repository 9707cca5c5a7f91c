#include "render/bloom.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

// A pixel as one register: red, green, blue and an unused value.
typedef float Rgb __attribute__((vector_size(16)));

struct Layer {
  int width = 0, height = 0;
  std::vector<Rgb> pixels;
  Layer(int w, int h)
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  Rgb& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  const Rgb& at(int x, int y) const {
    return pixels[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(std::clamp(x, 0, width - 1))];
  }
};

bool has_glow(const HdrImage& sum, float threshold) {
  const std::vector<float>& p = sum.rgba;
  for (std::size_t i = 0; i < p.size(); i += 4)
    if (p[i] > threshold || p[i + 1] > threshold || p[i + 2] > threshold) return true;
  return false;
}

// Writes the light above the threshold to a layer of half the size. A pixel that is a hundred times too
// bright, such as a glint of the sun, is limited to ten times, because it would flicker.
void extract(const HdrImage& sum, float threshold, Layer& out) {
  const float most = 10 * threshold;
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      Rgb total{};
      for (int k = 0; k < 4; ++k) {
        const int sx = std::min(2 * x + (k & 1), sum.width_px - 1),
                  sy = std::min(2 * y + (k >> 1), sum.height_px - 1);
        const float* p =
            sum.rgba.data() + 4 * (static_cast<std::size_t>(sy) * static_cast<std::size_t>(sum.width_px) +
                                   static_cast<std::size_t>(sx));
        const float brightest = std::max({p[0], p[1], p[2]});
        if (!(brightest > threshold)) continue;
        total += Rgb{p[0], p[1], p[2], 0} * (0.25f * (std::min(brightest, most) - threshold) / brightest);
      }
      out.at(x, y) = total;
    }
  });
}

// Returns a layer of half the size. It uses the binomial filter 1 3 3 1 in both directions, which is smooth
// enough for bright dots.
Layer half_of(const Layer& in) {
  Layer out((in.width + 1) / 2, (in.height + 1) / 2);
  constexpr std::array<float, 4> kWeights = {0.125f, 0.375f, 0.375f, 0.125f};
  tbb::parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x) {
      Rgb total{};
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
          total += in.at(2 * x + i - 1, 2 * y + j - 1) *
                   (kWeights[static_cast<std::size_t>(i)] * kWeights[static_cast<std::size_t>(j)]);
      out.at(x, y) = total;
    }
  });
  return out;
}

// Returns the interpolated value of a layer at the pixel (x, y) of a layer twice as large.
inline Rgb enlarged(const Layer& in, int x, int y) {
  const int sx = x / 2 - 1 + (x & 1), sy = y / 2 - 1 + (y & 1);
  const float fx = (x & 1) != 0 ? 0.25f : 0.75f, fy = (y & 1) != 0 ? 0.25f : 0.75f;
  return (in.at(sx, sy) * (1 - fx) + in.at(sx + 1, sy) * fx) * (1 - fy) +
         (in.at(sx, sy + 1) * (1 - fx) + in.at(sx + 1, sy + 1) * fx) * fy;
}

}  // namespace

void add_bloom(HdrImage& sum, const Bloom& options) {
  const float threshold = options.threshold / (options.exposure * options.sample_weight);
  if (!has_glow(sum, threshold)) return;
  std::vector<Layer> layers;
  layers.emplace_back((sum.width_px + 1) / 2, (sum.height_px + 1) / 2);
  extract(sum, threshold, layers[0]);
  const auto widest =
      static_cast<int>(std::lround(std::log2(options.radius * static_cast<float>(sum.height_px))));
  for (int k = 0; k < widest && std::min(layers.back().width, layers.back().height) > 2; ++k)
    layers.push_back(half_of(layers.back()));

  // All layers have the same total weight. A narrow layer therefore has more weight per pixel, so the glow
  // has a sharp core and a long tail.
  const float weight = options.strength / static_cast<float>(layers.size());
  for (std::size_t k = layers.size() - 1; k > 0; --k) {
    Layer& finer = layers[k - 1];
    tbb::parallel_for(0, finer.height, [&](int y) {
      for (int x = 0; x < finer.width; ++x) finer.at(x, y) += enlarged(layers[k], x, y);
    });
  }
  tbb::parallel_for(0, sum.height_px, [&](int y) {
    float* out = sum.rgba.data() + 4 * static_cast<std::size_t>(y) * static_cast<std::size_t>(sum.width_px);
    for (int x = 0; x < sum.width_px; ++x, out += 4) {
      const Rgb glow = enlarged(layers[0], x, y) * weight;
      for (int c = 0; c < 3; ++c) out[c] += glow[c];
    }
  });
}

}  // namespace offstage::render
