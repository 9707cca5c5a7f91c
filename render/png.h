#pragma once
/// Private: encodes PNG files with libdeflate. Level 1 and the filter UP take a third of zlib's time, and the
/// files are no larger.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace offstage::render {

/// Samples in rows from the top down. The samples of a pixel are adjacent; 16-bit samples are big-endian.
struct PngPixels {
  int width_px = 0, height_px = 0;
  int channels = 3;  ///< 1 grey, 3 red green blue, 4 with alpha
  int bits = 8;      ///< bits of a sample: 8 or 16
  std::span<const uint8_t> samples;
  std::string comment = {};   ///< comment, in UTF-8
  std::string settings = {};  ///< settings of the picture, in ASCII; see png_settings()
};

/// Returns the bytes of a PNG file. Throws std::invalid_argument if the sizes are inconsistent.
std::vector<uint8_t> encode_png(const PngPixels& pixels);

inline constexpr std::size_t kPngHeadBytes = 512;  ///< enough of a PNG file for settings_in_png()
/// Reads PngPixels::settings from the first kPngHeadBytes of a file made by encode_png; empty if there are
/// none.
std::string settings_in_png(std::span<const uint8_t> head);

}  // namespace offstage::render
