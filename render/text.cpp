#include "render/text.h"

#include <algorithm>
#include <string>
#include <vector>

#include <stb_easy_font.h>

namespace offstage::render {
namespace {

/// Replaces characters that the font lacks.
std::string printable(std::string_view text) {
  std::string line(text);
  for (char& c : line)
    if (c < ' ' || c > '~') c = '?';
  return line;
}

struct GlyphVertex {
  float x, y, z;
  uint8_t color[4];
};
static_assert(sizeof(GlyphVertex) == 16);

void fill(Image& image, int left, int top, int right, int bottom, const std::array<uint8_t, 3>& rgb) {
  for (int y = std::max(top, 0); y < std::min(bottom, image.height_px); ++y)
    for (int x = std::max(left, 0); x < std::min(right, image.width_px); ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                                static_cast<std::size_t>(x);
      std::ranges::copy(rgb, &image.rgba[4 * pixel]);
      image.rgba[4 * pixel + 3] = 255;
    }
}

}  // namespace

int text_width_px(std::string_view text) {
  return stb_easy_font_width(printable(text).data());
}

void draw_text(Image& image, int x_px, int y_px, std::string_view text, int scale,
               const std::array<uint8_t, 3>& rgb) {
  constexpr std::size_t kMostQuads = 32;  // greatest number of quads of one character
  std::string line = printable(text);
  std::vector<GlyphVertex> corners(4 * kMostQuads * line.size());
  const int quads = stb_easy_font_print(0, 0, line.data(), nullptr, corners.data(),
                                        static_cast<int>(corners.size() * sizeof(GlyphVertex)));
  for (int i = 0; i < quads; ++i) {
    const GlyphVertex& first = corners[4 * static_cast<std::size_t>(i)];
    const GlyphVertex& last = corners[4 * static_cast<std::size_t>(i) + 2];
    const auto at = [&](float v, int origin) { return origin + scale * static_cast<int>(v); };
    fill(image, at(first.x, x_px), at(first.y, y_px), at(last.x, x_px), at(last.y, y_px), rgb);
  }
}

}  // namespace offstage::render
