#include "render/image.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#include <xxhash.h>

namespace offstage::render {
namespace {

void require_same_size(const Image& a, const Image& b) {
  if (a.width_px == b.width_px && a.height_px == b.height_px && a.rgba.size() == b.rgba.size()) return;
  throw std::invalid_argument("images differ in size: " + std::to_string(a.width_px) + "x" +
                              std::to_string(a.height_px) + " and " + std::to_string(b.width_px) + "x" +
                              std::to_string(b.height_px));
}

}  // namespace

std::string pixel_hash(const Image& image) {
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), XXH3_freeState);
  XXH3_128bits_reset(state.get());
  const int32_t size[2] = {image.width_px, image.height_px};
  XXH3_128bits_update(state.get(), size, sizeof size);
  XXH3_128bits_update(state.get(), image.rgba.data(), image.rgba.size());
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  char text[33];
  std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(hash.high64),
                static_cast<unsigned long long>(hash.low64));
  return text;
}

bool ImageDifference::within_tolerance() const {
  return fraction_over <= 0.0005 && mean_delta <= 0.05;
}

ImageDifference difference(const Image& a, const Image& b) {
  require_same_size(a, b);
  ImageDifference result;
  uint64_t total = 0;
  for (std::size_t p = 0; p < a.rgba.size(); p += 4) {
    int worst = 0;
    for (std::size_t c = p; c < p + 4; ++c) {
      const int delta = std::abs(a.rgba[c] - b.rgba[c]);
      worst = std::max(worst, delta);
      total += static_cast<uint64_t>(delta);
    }
    result.max_delta = std::max(result.max_delta, worst);
    if (worst > 2) ++result.pixels_over;
  }
  result.total_delta = static_cast<double>(total);
  if (!a.rgba.empty()) {
    result.mean_delta = result.total_delta / static_cast<double>(a.rgba.size());
    result.fraction_over = static_cast<double>(result.pixels_over) / static_cast<double>(a.pixel_count());
  }
  return result;
}

Image reduced(const Image& image, int width_px) {
  const int step = std::max(1, (image.width_px + width_px - 1) / width_px);
  Image small{std::max(1, image.width_px / step), std::max(1, image.height_px / step), {}, image.transparent};
  small.rgba.reserve(4 * small.pixel_count());
  const int columns = std::min(step, image.width_px), rows = std::min(step, image.height_px);
  for (int y = 0; y < small.height_px; ++y)
    for (int x = 0; x < small.width_px; ++x)
      for (int c = 0; c < 4; ++c) {
        int sum = 0;
        for (int j = 0; j < rows; ++j)
          for (int i = 0; i < columns; ++i)
            sum +=
                image
                    .rgba[static_cast<std::size_t>(((y * step + j) * image.width_px + x * step + i) * 4 + c)];
        small.rgba.push_back(static_cast<uint8_t>((sum + columns * rows / 2) / (columns * rows)));
      }
  return small;
}

Image amplified_difference(const Image& a, const Image& b, int gain) {
  require_same_size(a, b);
  Image result{a.width_px, a.height_px, std::vector<uint8_t>(a.rgba.size())};
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    result.rgba[i] = static_cast<uint8_t>(std::clamp(std::abs(a.rgba[i] - b.rgba[i]) * gain, 0, 255));
  }
  for (std::size_t i = 3; i < result.rgba.size(); i += 4) result.rgba[i] = 255;
  return result;
}

}  // namespace offstage::render
