#pragma once
/// Private: PNG files by libdeflate (level 1, filter UP: a third of zlib's time, and no larger).

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace offstage::render {

/// Samples row by row from the top down, those of a pixel together, of two bytes the upper one first.
struct PngPixels {
  int width_px = 0, height_px = 0;
  int channels = 3;  ///< 1 grey, 3 red green blue, 4 and alpha
  int bits = 8;      ///< of a sample: 8 or 16
  std::span<const uint8_t> samples;
  std::string comment = {};  ///< text that goes along, in UTF-8
};

/// Throws std::invalid_argument if sizes do not agree.
std::vector<uint8_t> encode_png(const PngPixels& pixels);

}  // namespace offstage::render
