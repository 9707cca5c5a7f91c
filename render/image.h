#pragma once
/// Pictures in memory. Rows are stored from the top down everywhere except in OpenGL.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace offstage::render {

/// 8 bits per channel, RGBA, sRGB-encoded colour, straight alpha.
struct Image {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgba;  ///< width * height * 4
  bool transparent = false;   ///< whether alpha is used; otherwise files are written without alpha

  std::size_t pixel_count() const {
    return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  }
};

/// Linear light, RGBA float, premultiplied alpha.
struct HdrImage {
  int width_px = 0, height_px = 0;
  std::vector<float> rgba;   ///< width * height * 4
  bool transparent = false;  ///< whether alpha is used; see Image::transparent

  std::size_t pixel_count() const {
    return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  }
};

/// Returns the XXH3-128 hash of size and pixels as 32 hexadecimal digits. It does not depend on the file
/// format.
std::string pixel_hash(const Image& image);

/// Difference of two images of the same size. `max_delta` and `mean_delta` are over the RGBA channels in
/// 8-bit steps.
struct ImageDifference {
  int max_delta = 0;
  double mean_delta = 0;
  std::size_t pixels_over = 0;  ///< pixels with a channel off by more than 2
  double fraction_over = 0;     ///< `pixels_over` as a fraction of all pixels
  double total_delta = 0;       ///< sum of all absolute channel differences

  /// Returns whether the difference is acceptable for a golden of another fingerprint class: at most 0.05 %
  /// of the pixels differ by more than 2 steps, and the mean difference is at most 0.05 steps.
  bool within_tolerance() const;
};
/// Compares two images. Throws std::invalid_argument if their sizes differ.
ImageDifference difference(const Image& a, const Image& b);
/// Returns a copy at most `width_px` wide. Each pixel is the mean of the original pixels that it covers.
Image reduced(const Image& image, int width_px);
/// Returns an opaque image of the absolute difference times `gain`.
Image amplified_difference(const Image& a, const Image& b, int gain = 16);

}  // namespace offstage::render
