#pragma once
/// Adds a glow around very bright parts of a picture, as a camera lens does. Light above a threshold is
/// spread by a series of blurs; each is twice as wide as the one before (after J. Jimenez, "Next Generation
/// Post Processing in Call of Duty: Advanced Warfare", 2014).

#include "render/image.h"

namespace offstage::render {

struct Bloom {
  float threshold = 4;     ///< value of the brightest channel, after exposure, from which on light spreads; a
                           ///< sunlit white is about 4
  float strength = 0.12f;  ///< fraction of the light above the threshold that is spread
  float radius = 0.04f;    ///< radius of the widest blur, as a fraction of the picture's height
  float exposure = 1;      ///< linear factor of the light; see ToneMap::exposure
  float sample_weight = 1;  ///< 1 / number of sub-frames summed in the image
};

/// Adds the glow to the colour channels of the sum; alpha stays. Nothing changes if no pixel is above the
/// threshold.
void add_bloom(HdrImage& sum, const Bloom& options);

}  // namespace offstage::render
