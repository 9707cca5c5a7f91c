#include "effects/color.h"

#include <cmath>
#include <vector>

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

TEST(Ramp, OfLinesIsTheAgeRamp) {
  const ColorRamp keys{{{0.1, Rgba(1, 0, 0, 1)},
                        {0.101, Rgba(0, 3, 0, 1)},
                        {0.5, Rgba(0, 1, 2, 1)},
                        {0.5, Rgba(4, 4, 4, 0)},
                        {0.9, Rgba(0, 0, 2, 0)}}};
  const Ramp<Rgba> ramp(keys);
  for (int i = -100; i <= 1200; ++i)
    ASSERT_LT((ramp.at(i / 1000.0) - keys.at(i / 1000.0)).norm(), 1e-5f) << i;
  EXPECT_EQ(Ramp<float>(SizeRamp{{{0.5, 2.f}}}).at(0.9), 2.f);
}

TEST(Ramp, SmoothGoesThroughItsKeysWithoutOvershootOrKink) {
  const SizeRamp keys{{{0, 0.f}, {0.1, 1.f}, {0.4, 1.2f}, {0.7, 0.f}, {1, 0.f}}};
  const Ramp<float> ramp(keys, RampKind::smooth);
  for (const auto& [age, value] : keys.keys) EXPECT_NEAR(ramp.at(age), value, 1e-6f);
  const float d = 1e-3f;
  for (float t = 0; t < 1 - 2 * d; t += d) {
    EXPECT_GE(ramp.at(t), -1e-6f);
    EXPECT_LE(ramp.at(t), 1.2f + 1e-6f);
    // The slope changes by no more than the curvature of a cubic over these intervals allows.
    EXPECT_LT(std::abs(ramp.at(t + 2 * d) - 2 * ramp.at(t + d) + ramp.at(t)) / d, 0.7f);
  }
}

TEST(Ramp, EvaluatesOverNormalizedAges) {
  const Ramp<float> ramp(SizeRamp{{{0, 1.f}, {1, 3.f}}});
  const std::vector<Real> age = {0, 1, 2, 5}, lifespan = {1, 4, 4, 5};
  std::vector<float> size(4);
  ramp.evaluate(age, lifespan, size);
  EXPECT_EQ(size, (std::vector<float>{1, 1.5f, 2, 3}));
}

TEST(StartColor, DependsOnlyOnTheId) {
  const StartColor start{.mean = Rgba(1, 0.5f, 0.25f, 1), .deviation = Rgba(0.1f, 0, 0.2f, 0)};
  const RandomStream random(3, 4);
  Rgba sum = Rgba::Zero();
  constexpr int kN = 100'000;
  for (uint64_t id = 0; id < kN; ++id) {
    const Rgba c = start.of(random, id);
    ASSERT_GE(c.minCoeff(), 0);
    EXPECT_EQ(c[1], 0.5f);
    sum += c / kN;
  }
  EXPECT_NEAR(sum[0], 1, 3 * 0.054f / std::sqrt(kN));
  EXPECT_NEAR(sum[2], 0.25f, 3 * 0.108f / std::sqrt(kN));
  EXPECT_EQ(start.of(random, 17), start.of(random, 17));
}

}  // namespace
}  // namespace offstage::effects
