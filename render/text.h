#pragma once
/// Draws short texts in pictures, such as the labels of a contact sheet. The only font (stb_easy_font)
/// consists of whole pixels, so texts are the same on every machine. Characters that are not ASCII become
/// question marks.

#include <array>
#include <cstdint>
#include <string_view>

#include "render/image.h"

namespace offstage::render {

/// Height of a line from the top of a capital to the bottom of a "g", at scale 1.
inline constexpr int kTextHeight_px = 10;

/// Returns the width of one line at scale 1 [px].
int text_width_px(std::string_view text);

/// Draws one line with its upper left corner at (x, y), each pixel of the font as scale x scale pixels. Parts
/// outside of the image are clipped.
void draw_text(Image& image, int x_px, int y_px, std::string_view text, int scale,
               const std::array<uint8_t, 3>& rgb);

}  // namespace offstage::render
