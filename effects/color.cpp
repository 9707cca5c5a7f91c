#include "effects/color.h"

#include "effects/distribution.h"

namespace offstage::effects {

Rgba StartColor::of(const RandomStream& random, uint64_t id) const {
  // Property numbers for drawing. They differ from the simulation's numbers, so that the random numbers are
  // independent.
  constexpr uint32_t kBrightness = 1u << 24, kChannel = kBrightness + 1;
  const auto varied = [&](float middle, float spread, uint32_t property) {
    if (spread == 0) return middle;
    const Normal n{.mean = middle, .deviation = spread, .min = 0};
    return static_cast<float>(sample(n, random.uniform(id, property), 0));
  };
  Rgba color;
  for (int c = 0; c < 4; ++c) color[c] = varied(mean[c], deviation[c], kChannel + static_cast<uint32_t>(c));
  color.w() = std::min(color.w(), 1.f);
  color.head<3>() *= varied(1, brightness_deviation, kBrightness);
  return color;
}

}  // namespace offstage::effects
