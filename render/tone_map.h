#pragma once
/// From linear light to a displayable picture, on the CPU by tables, so that the bits do not depend on the
/// GPU driver: exposure, filmic curve, sRGB encoding, a fixed dither against banding.

#include "render/image.h"

namespace offstage::render {

enum class ToneCurve {
  filmic,  ///< soft toe and shoulder
  linear,  ///< clipped: greys come back as they went in
};

struct ToneMap {
  ToneCurve curve = ToneCurve::filmic;
  float exposure = 1;       ///< linear factor, > 0
  float sample_weight = 1;  ///< 1 / number of sub-frames summed in the image
  bool dither = true;
};

/// Linear [0, 1] to sRGB [0, 1] and back (IEC 61966-2-1).
float srgb_encode(float linear);
float srgb_decode(float encoded);

/// The exposure that gives a picture the mean brightness of a sunlit grey of 18 %: by the geometric mean of
/// its luminance, which a lamp or a black corner hardly changes, and within four stops of 1 either way.
float metered_exposure(const HdrImage& sum, float sample_weight);

Image tone_map(const HdrImage& sum, const ToneMap& options);

/// Smooths stair steps along edges of high contrast: the draft quality's anti-aliasing, for one sub-frame.
void filter_edges(Image& image);

}  // namespace offstage::render
