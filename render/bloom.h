#pragma once
/// Glow around what is brighter than the picture can show, as in a lens: light above a threshold is spread
/// by blurs of doubling width (after J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced
/// Warfare", 2014).

#include "render/image.h"

namespace offstage::render {

struct Bloom {
  float threshold = 4;      ///< of the brightest channel after exposure; a sunlit white is about 4
  float strength = 0.12f;   ///< share of the light above it that is spread
  float radius = 0.04f;     ///< of the widest blur, as a share of the picture's height
  float exposure = 1;       ///< as in ToneMap
  float sample_weight = 1;  ///< 1 / number of sub-frames summed in the image
};

/// Adds the glow to the sum, alpha excepted. Exactly nothing changes if nothing is above the threshold.
void add_bloom(HdrImage& sum, const Bloom& options);

}  // namespace offstage::render
