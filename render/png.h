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
  std::string comment = {};   ///< text that goes along, in UTF-8
  std::string settings = {};  ///< what the picture was made with, in ASCII: png_settings
};

/// Throws std::invalid_argument if sizes do not agree.
std::vector<uint8_t> encode_png(const PngPixels& pixels);

/// PngPixels::settings of a file that encode_png made, from its first kPngHeadBytes; empty if there are none.
inline constexpr std::size_t kPngHeadBytes = 512;
std::string settings_in_png(std::span<const uint8_t> head);

}  // namespace offstage::render
