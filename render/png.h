#pragma once
/// Private: PNG files by libdeflate (level 1, filter UP: a third of zlib's time, and no larger).

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace offstage::render {

/// Samples by rows from the top down, channels interleaved; 16-bit samples are big-endian.
struct PngPixels {
  int width_px = 0, height_px = 0;
  int channels = 3;  ///< 1 grey, 3 RGB, 4 RGBA
  int bits = 8;      ///< bits per sample: 8 or 16
  std::span<const uint8_t> samples;
<<<<<<< ours
  std::string comment = {};  ///< text that goes along, in UTF-8
=======
  std::string comment = {};   ///< text stored in the file, UTF-8
  std::string settings = {};  ///< identifies the settings of the film, ASCII: see png_settings
>>>>>>> theirs
};

/// Encodes a PNG. Throws std::invalid_argument if the size of the data does not match.
std::vector<uint8_t> encode_png(const PngPixels& pixels);

<<<<<<< ours
=======
/// Reads PngPixels::settings of a file made by encode_png from its first kPngHeadBytes; empty if there are
/// none.
inline constexpr std::size_t kPngHeadBytes = 512;
std::string settings_in_png(std::span<const uint8_t> head);

>>>>>>> theirs
}  // namespace offstage::render
