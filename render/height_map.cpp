#include "render/height_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>

namespace offstage::render {
namespace {

std::size_t texel_at(const Image& image, int x, int y) {
  return 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
              static_cast<std::size_t>(x));
}

float luminance_at(const Image& image, int x, int y) {
  const uint8_t* p = image.rgba.data() + texel_at(image, x, y);
  return (0.2126f * static_cast<float>(p[0]) + 0.7152f * static_cast<float>(p[1]) +
          0.0722f * static_cast<float>(p[2])) /
         255;
}

bool has_any_alpha(const Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    if (image.rgba[i] != 255) return true;
  return false;
}

}  // namespace

bool is_normal_map(const Image& image) {
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < image.rgba.size(); i += 4)
    for (std::size_t c = 0; c < 3; ++c) sum[c] += image.rgba[i + c];
  const double n = std::max(1.0, static_cast<double>(image.pixel_count())) * 255;
  return sum[2] / n > 0.65 && std::abs(sum[0] / n - 0.5) < 0.15 && std::abs(sum[1] / n - 0.5) < 0.15;
}

Image normals_of_heights(const Image& heights, float bump) {
  constexpr float kHeight = 0.01f;  // height of white, as a fraction of the width of the picture
  const int w = heights.width_px, h = heights.height_px;
  Image normals{w, h, std::vector<uint8_t>(heights.rgba.size(), 255)};
  const float slope = 0.5f * kHeight * bump * static_cast<float>(w);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const float dx = luminance_at(heights, (x + 1) % w, y) - luminance_at(heights, (x + w - 1) % w, y);
      const float dy = luminance_at(heights, x, (y + 1) % h) - luminance_at(heights, x, (y + h - 1) % h);
      const Eigen::Vector3f normal = Eigen::Vector3f(-slope * dx, slope * dy, 1).normalized();
      for (int c = 0; c < 3; ++c)
        normals.rgba[texel_at(normals, x, y) + static_cast<std::size_t>(c)] =
            static_cast<uint8_t>(std::lround(127.5f * (normal[c] + 1)));
    }
  return normals;
}

Image with_mask(const Image& base, const Image& mask) {
  Image result = base;
  if (result.rgba.empty())
    result = {mask.width_px, mask.height_px, std::vector<uint8_t>(mask.rgba.size(), 255)};
  const bool own_alpha = has_any_alpha(mask);
  for (int y = 0; y < result.height_px; ++y)
    for (int x = 0; x < result.width_px; ++x) {
      const auto source = [](int at, int size, int mask_size) {
        return static_cast<int>((2 * int64_t{at} + 1) * mask_size / (2 * int64_t{size}));
      };
      const int mx = source(x, result.width_px, mask.width_px),
                my = source(y, result.height_px, mask.height_px);
      const uint8_t alpha = own_alpha ? mask.rgba[texel_at(mask, mx, my) + 3]
                                      : static_cast<uint8_t>(std::lround(255 * luminance_at(mask, mx, my)));
      result.rgba[texel_at(result, x, y) + 3] = alpha;
    }
  result.transparent = true;
  return result;
}

bool is_cut_out(const Image& image) {
  std::size_t between = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) between += image.rgba[i] > 10 && image.rgba[i] < 245;
  return has_any_alpha(image) && 10 * between <= image.pixel_count();
}

}  // namespace offstage::render
