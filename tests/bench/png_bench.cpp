// One frame of 1920x1080 to PNG bytes: the cost of every frame of a sequence.

#include <cmath>

#include <benchmark/benchmark.h>

#include "render/image_io.h"

namespace {

using offstage::render::Image;

/// Returns a picture that resembles a frame with particles: a smooth sky with soft discs, and noise of one
/// step as from dither and textures.
Image frame(uint8_t alpha) {
  Image image{1920, 1080, {}};
  image.rgba.reserve(image.pixel_count() * 4);
  uint32_t noise = 1;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      const double disc = std::exp(-(std::pow(x % 160 - 80, 2) + std::pow(y % 135 - 67, 2)) / 600);
      noise = noise * 1664525u + 1013904223u;
      for (const double base : {60.0, 110.0, 190.0}) {
        image.rgba.push_back(static_cast<uint8_t>(base * (1 - 0.0004 * y) + 60 * disc + (noise >> 31)));
      }
      image.rgba.push_back(alpha);
    }
  }
  return image;
}

void encode_1080p(benchmark::State& state) {
  const Image image = frame(static_cast<uint8_t>(state.range(0)));
  std::size_t size = 0;
  for (auto _ : state) size = offstage::render::encode_png(image).size();
  state.counters["MB"] = static_cast<double>(size) * 1e-6;
}
BENCHMARK(encode_1080p)->ArgName("alpha")->Arg(255)->Arg(128)->Unit(benchmark::kMillisecond);

}  // namespace
