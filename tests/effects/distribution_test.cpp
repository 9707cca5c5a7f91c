#include "effects/distribution.h"

#include <cmath>

#include <gtest/gtest.h>

namespace offstage::effects {
namespace {

struct Statistics {
  Real mean, deviation;
};

/// Statistics over evenly spaced quantiles: the integral instead of a random sample.
Statistics integrate(const Varying& v) {
  constexpr int kN = 200'000;
  Real sum = 0, sum2 = 0;
  for (int i = 0; i < kN; ++i) {
    const Real x = sample(v, (i + 0.5) / kN, 0);
    sum += x;
    sum2 += x * x;
  }
  return {sum / kN, std::sqrt(sum2 / kN - sum / kN * sum / kN)};
}

// The variance of a normal distribution truncated at one deviation is 1 - 2 phi(1) / (2 Phi(1) - 1).
TEST(Distribution, NormalIsTruncatedAtOneDeviationByDefault) {
  const Real phi = std::exp(-0.5) / std::sqrt(2 * M_PI), inside = std::erf(std::sqrt(0.5));
  const Statistics cut = integrate(Normal{4, 2}),
                   whole = integrate(Normal{.mean = 4, .deviation = 2, .clip = false});
  EXPECT_NEAR(cut.mean, 4, 1e-9);
  EXPECT_NEAR(cut.deviation, 2 * std::sqrt(1 - 2 * phi / inside), 1e-6);
  EXPECT_NEAR(whole.mean, 4, 1e-9);
  EXPECT_NEAR(whole.deviation, 2, 1e-3);
  EXPECT_NEAR(sample(Normal{4, 2}, 1e-16, 0), 2, 1e-12);
  EXPECT_EQ(sample(Normal{4, 2, 3.5, 5}, 0.001, 0), 3.5);
}

TEST(Distribution, BoundsContainAllSamples) {
  const std::vector<Varying> all = {3.0, Normal{4, 2}, Normal{4, 2, 3, 4.5}, Uniform{-1, 2},
                                    Curve{{{0, 5}, {1, 2}, {3, 8}}}};
  for (const Varying& v : all) {
    Real low = 1e300, high = -1e300;
    for (int i = 0; i <= 1000; ++i) {
      const Real x = sample(v, (i + 0.5) / 1001, 3.0 * i / 1000);
      low = std::min(low, x);
      high = std::max(high, x);
    }
    EXPECT_GE(low, lower_bound(v) - 1e-12);
    EXPECT_LE(high, upper_bound(v) + 1e-12);
    EXPECT_NEAR(low, lower_bound(v), 0.02);
    EXPECT_NEAR(high, upper_bound(v), 0.02);
  }
  EXPECT_TRUE(std::isinf(upper_bound(Normal{.mean = 1, .deviation = 1, .clip = false})));
}

TEST(Distribution, CurveIsPiecewiseLinearAndHeldAtItsEnds) {
  const Curve curve{{{1, 10}, {2, 20}, {4, 0}}};
  for (const auto& [t, value] : {std::pair(0.0, 10.0), {1.5, 15.0}, {2.0, 20.0}, {3.0, 10.0}, {9.0, 0.0}})
    EXPECT_DOUBLE_EQ(sample(curve, 0.3, t), value);
}

}  // namespace
}  // namespace offstage::effects
