#include "producer/build/texts.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "producer/base/time_code.h"
#include "render/text.h"
#include "render/tone_map.h"

namespace offstage::producer {
namespace {

constexpr int kLine_px = render::kTextHeight_px + 3;  // height of a line with its gap, at scale 1

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
}

std::vector<std::string> lines_of(const TextOverlay& overlay, const Snapshot& moment) {
  std::string text = overlay.text;
  replace_all(text, "{time}", time_code(moment.time));
  replace_all(text, "{frame}", fmt::format("{}", moment.frame));
  replace_all(text, "{bodies}", fmt::format("{}", moment.bodies.size()));
  replace_all(text, "{particles}", fmt::format("{}", moment.point_count()));
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

std::array<uint8_t, 3> bytes_of(const Color& color) {
  std::array<uint8_t, 3> rgb{};
  for (std::size_t c = 0; c < 3; ++c)
    rgb[c] = static_cast<uint8_t>(std::lround(
        255 * std::clamp(render::srgb_encode(color.rgba[static_cast<Eigen::Index>(c)]), 0.f, 1.f)));
  return rgb;
}

/// Returns the size of a pixel of the font in the picture. It is a whole number, and so small that the
/// longest line fits into the picture, if possible.
int scale_of(const TextOverlay& overlay, const std::vector<std::string>& lines, const render::Image& image) {
  int longest = 0;
  for (const std::string& line : lines) longest = std::max(longest, render::text_width_px(line));
  const int margins = 4 * kLine_px / 3;
  const auto wanted = static_cast<int>(std::lround(overlay.size * image.height_px / render::kTextHeight_px));
  return std::max(1, std::min(wanted, image.width_px / (longest + margins)));
}

void write_text(const TextOverlay& overlay, const Snapshot& moment, render::Image& image) {
  const std::vector<std::string> lines = lines_of(overlay, moment);
  const int scale = scale_of(overlay, lines, image);
  const int line_px = scale * kLine_px, margin = 2 * line_px / 3;
  const int height = static_cast<int>(lines.size()) * line_px;
  const bool bottom = overlay.place == TextPlace::bottom_left || overlay.place == TextPlace::bottom_right;
  const bool right = overlay.place == TextPlace::top_right || overlay.place == TextPlace::bottom_right;
  const bool middle = overlay.place == TextPlace::center;
  int y = middle ? (image.height_px - height) / 2 : bottom ? image.height_px - margin - height : margin;
  for (const std::string& line : lines) {
    const int width = scale * render::text_width_px(line);
    const int x = middle ? (image.width_px - width) / 2 : right ? image.width_px - margin - width : margin;
    // A dark copy behind the text makes it readable on any background.
    const int shift = std::max(1, scale / 2);
    render::draw_text(image, x + shift, y + shift, line, scale, {0, 0, 0});
    render::draw_text(image, x, y, line, scale, bytes_of(overlay.color));
    y += line_px;
  }
}

}  // namespace

void write_texts(const Scene& scene, const Snapshot& moment, render::Image& image) {
  for (const Overlay& overlay : scene.overlays) {
    const auto* text = std::get_if<TextOverlay>(&overlay);
    if (text && moment.time >= text->from && (!text->until || moment.time < *text->until))
      write_text(*text, moment, image);
  }
}

}  // namespace offstage::producer
