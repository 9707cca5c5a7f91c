#pragma once
/// Converts linear light to a displayable picture: exposure, filmic curve, sRGB encoding, and a fixed dither
/// against banding. It uses tables on the CPU, so that the result does not depend on the GPU driver.

#include "render/image.h"

namespace offstage::render {

enum class ToneCurve {
  filmic,  ///< soft toe and shoulder
  linear,  ///< clipped, without a curve: values in [0, 1] keep their size
};

struct ToneMap {
  ToneCurve curve = ToneCurve::filmic;
  float exposure = 1;       ///< linear factor, > 0
  float sample_weight = 1;  ///< 1 / number of sub-frames summed in the image
  bool dither = true;
};

/// Convert a component from linear light to sRGB, and back (IEC 61966-2-1). Both values are in [0, 1].
float srgb_encode(float linear);
float srgb_decode(float encoded);

/// Returns the exposure at which the mean brightness of a picture is that of a sunlit surface with an albedo
/// of 18 %. The mean is the geometric mean of the luminance, which small bright or dark areas hardly change.
/// The result is in [1/16, 16].
float metered_exposure(const HdrImage& sum, float sample_weight);

/// Converts a sum of sub-frames to a displayable picture.
Image tone_map(const HdrImage& sum, const ToneMap& options);

/// Smooths jagged edges of high contrast: the anti-aliasing of the draft quality, which has one sub-frame.
void filter_edges(Image& image);

}  // namespace offstage::render
