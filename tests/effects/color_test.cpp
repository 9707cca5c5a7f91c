#include "effects/color.h"

#include <gtest/gtest.h>

namespace offstage::effects {
namespace {

TEST(AgeRamp, IsLinearBetweenItsKeysAndHeldAtTheEnds) {
  const SizeRamp ramp{{{0.2, 1.f}, {0.6, 3.f}, {1.0, 0.f}}};
  EXPECT_EQ(ramp.at(0), 1.f);
  EXPECT_EQ(ramp.at(0.2), 1.f);
  EXPECT_FLOAT_EQ(ramp.at(0.3), 1.5f);
  EXPECT_FLOAT_EQ(ramp.at(0.6), 3.f);
  EXPECT_FLOAT_EQ(ramp.at(0.8), 1.5f);
  EXPECT_EQ(ramp.at(7), 0.f);
}

TEST(AgeRamp, TwoKeysOfOneAgeAreAStep) {
  const SizeRamp ramp{{{0, 1.f}, {0.5, 1.f}, {0.5, 4.f}, {1, 4.f}}};
  EXPECT_FLOAT_EQ(ramp.at(0.49), 1.f);
  EXPECT_FLOAT_EQ(ramp.at(0.51), 4.f);
}

TEST(AgeRamp, ColoursMixChannelByChannel) {
  const ColorRamp ramp{{{0, Rgba(1, 0, 0, 1)}, {1, Rgba(0, 0, 2, 0)}}};
  EXPECT_TRUE(ramp.at(0.25).isApprox(Rgba(0.75f, 0, 0.5f, 0.75f)));
}

}  // namespace
}  // namespace offstage::effects
