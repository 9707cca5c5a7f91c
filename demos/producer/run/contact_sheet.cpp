#include "producer/run/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "render/text.h"

namespace offstage::producer {
namespace {

using Rgb = std::array<uint8_t, 3>;

constexpr Rgb kPaper = {24, 25, 28}, kInk = {225, 227, 230}, kHeadingInk = {150, 190, 235},
              kFaultPaper = {64, 22, 24}, kFaultInk = {255, 170, 160};
constexpr int kGap_px = 12;    // between pictures, and around the sheet
constexpr int kTextScale = 2;  // scale of the text
constexpr int kLine_px = kTextScale * render::kTextHeight_px + 4;
constexpr int kMostSide_px = 16384;  // common limit of image readers

int width_of(const std::string& text) {
  return kTextScale * render::text_width_px(text);
}

/// Returns the text if it fits into the width, otherwise ".." and as much of its end as fits.
std::string cut_start(std::string text, int width_px) {
  if (width_of(text) <= width_px) return text;
  while (!text.empty() && width_of(".." + text) > width_px) text.erase(0, 1);
  return ".." + text;
}

std::string cut_end(std::string text, int width_px) {
  if (width_of(text) <= width_px) return text;
  while (!text.empty() && width_of(text + "..") > width_px) text.pop_back();
  return text + "..";
}

/// Splits a text into lines of at most this width, at spaces. A word that is wider than a line is cut.
std::vector<std::string> wrapped(const std::string& text, int width_px) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!lines.empty() && width_of(lines.back() + " " + word) <= width_px)
      lines.back() += " " + word;
    else
      lines.push_back(cut_end(word, width_px));
  }
  return lines;
}

render::Image blank(int width_px, int height_px) {
  render::Image image{width_px, height_px, {}};
  image.rgba.resize(4 * image.pixel_count());
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    std::ranges::copy(kPaper, &image.rgba[4 * i]);
    image.rgba[4 * i + 3] = 255;
  }
  return image;
}

std::size_t pixel_at(const render::Image& image, int x, int y) {
  return 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
              static_cast<std::size_t>(x));
}

/// Draws a picture on the sheet; transparent parts show the background.
void paste(render::Image& sheet, const render::Image& picture, int left, int top) {
  for (int y = 0; y < picture.height_px; ++y)
    for (int x = 0; x < picture.width_px; ++x) {
      const uint8_t* from = &picture.rgba[pixel_at(picture, x, y)];
      uint8_t* to = &sheet.rgba[pixel_at(sheet, left + x, top + y)];
      for (int c = 0; c < 3; ++c)
        to[c] = static_cast<uint8_t>((from[c] * from[3] + to[c] * (255 - from[3])) / 255);
    }
}

/// Sizes of the parts of a sheet [px].
struct Layout {
  int columns, rows, width, height;  // width and height of one picture
  int label_lines, heading_lines;

  int cell_width() const { return width + kGap_px; }
  int cell_height() const { return height + 4 + label_lines * kLine_px + kGap_px; }
  int top() const { return kGap_px + heading_lines * kLine_px + (heading_lines > 0 ? 4 : 0); }
  int sheet_width() const { return kGap_px + columns * cell_width(); }
  int sheet_height() const { return top() + rows * cell_height(); }
};

Layout layout_of(const std::vector<std::string>& heading, const std::vector<SheetCell>& cells, int columns) {
  const int count = static_cast<int>(cells.size());
  Layout layout{columns, (count + columns - 1) / columns, 0, 0, 0, static_cast<int>(heading.size())};
  for (const SheetCell& cell : cells) {
    layout.width = std::max(layout.width, cell.picture.width_px);
    layout.height = std::max(layout.height, cell.picture.height_px);
    layout.label_lines = std::max(layout.label_lines, static_cast<int>(cell.label.size()));
  }
  constexpr int kLeastWidth = 160, kLeastHeight = 90;  // size of the cells if there is no picture at all
  layout.width = std::max(layout.width, kLeastWidth);
  layout.height = std::max(layout.height, kLeastHeight);
  return layout;
}

void draw_fault(render::Image& sheet, const Layout& layout, const std::string& fault, int left, int top) {
  for (int y = 0; y < layout.height; ++y)
    for (int x = 0; x < layout.width; ++x)
      std::ranges::copy(kFaultPaper, &sheet.rgba[pixel_at(sheet, left + x, top + y)]);
  int y = top + kGap_px / 2;
  for (const std::string& line : wrapped(fault, layout.width - kGap_px)) {
    if (y + kLine_px > top + layout.height) break;
    render::draw_text(sheet, left + kGap_px / 2, y, line, kTextScale, kFaultInk);
    y += kLine_px;
  }
}

void draw_cell(render::Image& sheet, const Layout& layout, const SheetCell& cell, int left, int top) {
  if (cell.picture.rgba.empty())
    draw_fault(sheet, layout, cell.fault, left, top);
  else
    paste(sheet, cell.picture, left, top);
  int y = top + layout.height + 4;
  for (const std::string& line : cell.label) {
    render::draw_text(sheet, left, y, cut_start(line, layout.width), kTextScale, kInk);
    y += kLine_px;
  }
}

}  // namespace

render::Image contact_sheet(const std::vector<std::string>& heading, const std::vector<SheetCell>& cells,
                            int columns) {
  const Layout layout = layout_of(heading, cells, columns);
  render::Image sheet = blank(layout.sheet_width(), layout.sheet_height());
  for (std::size_t i = 0; i < heading.size(); ++i)
    render::draw_text(sheet, kGap_px, kGap_px + static_cast<int>(i) * kLine_px,
                      cut_end(heading[i], layout.sheet_width() - 2 * kGap_px), kTextScale, kHeadingInk);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const int column = static_cast<int>(i) % columns, row = static_cast<int>(i) / columns;
    draw_cell(sheet, layout, cells[i], kGap_px + column * layout.cell_width(),
              layout.top() + row * layout.cell_height());
  }
  return sheet;
}

void check_sheet_size(std::size_t cells, int columns, int width_px, int height_px) {
  const std::size_t rows =
      (cells + static_cast<std::size_t>(columns) - 1) / static_cast<std::size_t>(columns);
  const auto side = [](std::size_t count, int size) {
    return count * static_cast<std::size_t>(size + kGap_px + 2 * kLine_px);
  };
  if (side(static_cast<std::size_t>(columns), width_px) <= kMostSide_px &&
      side(rows, height_px) <= kMostSide_px)
    return;
  throw std::invalid_argument(
      fmt::format("a sheet of {} x {} pictures of {} x {} pixels is too large (at most {} pixels per side); "
                  "use a smaller --size",
                  columns, rows, width_px, height_px, kMostSide_px));
}

int columns_for(std::size_t cells) {
  const int count = static_cast<int>(cells);
  constexpr int kOneRow = 5;
  if (count <= kOneRow) return std::max(count, 1);
  const int root = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  int best = root;
  const auto left_empty = [&](int columns) { return (columns - count % columns) % columns; };
  for (int columns = root; columns <= root + 2; ++columns)
    if (left_empty(columns) < left_empty(best)) best = columns;
  return best;
}

}  // namespace offstage::producer
