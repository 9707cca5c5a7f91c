#include "effects/random.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace offstage::effects {
namespace {

TEST(Philox, KnownAnswers) {
  using Words = std::array<uint32_t, 4>;
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const uint32_t ones = 0xffffffff;
  EXPECT_EQ(philox({ones, ones, ones, ones}, {ones, ones}),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(StreamId, IsFnv1a) {
  EXPECT_EQ(stream_id(""), 0xcbf29ce484222325u);
  EXPECT_EQ(stream_id("foobar"), 0x85944171f73967e8u);
}

TEST(RandomStream, MomentsOfTheUniformDistribution) {
  const RandomStream random(7, 3);
  constexpr int kN = 100'000;
  Real sum = 0, sum2 = 0, lag = 0, last = 0.5;
  for (uint64_t i = 0; i < kN; ++i) {
    const Real u = random.uniform(i, 5);
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
    sum2 += u * u;
    lag += (u - 0.5) * (last - 0.5);
    last = u;
  }
  EXPECT_NEAR(sum / kN, 1.0 / 2, 3 * std::sqrt(1.0 / 12 / kN));
  EXPECT_NEAR(sum2 / kN, 1.0 / 3, 3 * std::sqrt(4.0 / 45 / kN));
  EXPECT_NEAR(lag / kN, 0, 3.0 / 12 / std::sqrt(kN));
}

TEST(RandomStream, SeedStreamIndexAndPropertyAllMatter) {
  const Real base = RandomStream(1, 2).uniform(3, 4);
  EXPECT_EQ(base, RandomStream(1, 2).uniform(3, 4));
  for (Real other : {RandomStream(2, 2).uniform(3, 4), RandomStream(1, 3).uniform(3, 4),
                     RandomStream(1, 2).uniform(4, 4), RandomStream(1, 2).uniform(3, 5)})
    EXPECT_NE(base, other);
}

TEST(RandomStream, BelowIsUniformAndInRange) {
  const RandomStream random(1, 1);
  std::array<int, 7> counts{};
  constexpr int kN = 70'000;
  for (uint64_t i = 0; i < kN; ++i) ++counts.at(random.below(7, i, 0));
  const Real sigma = std::sqrt(kN * (1.0 / 7) * (6.0 / 7));
  for (int c : counts) EXPECT_NEAR(c, kN / 7, 4 * sigma);
}

TEST(Permutation, IsABijectionThatDependsOnItsKey) {
  for (uint64_t n : {1u, 2u, 3u, 10u, 1000u, 4097u}) {
    const Permutation a(n, 1), b(n, 2);
    std::set<uint64_t> seen;
    uint64_t equal = 0;
    for (uint64_t i = 0; i < n; ++i) {
      ASSERT_LT(a(i), n);
      seen.insert(a(i));
      equal += a(i) == b(i);
    }
    EXPECT_EQ(seen.size(), n);
    if (n >= 1000) {
      EXPECT_LT(equal, 20u);
    }
  }
}

// p = erfc(-x / sqrt 2) / 2. erfc keeps its relative accuracy in the lower tail.
TEST(NormalQuantile, InvertsTheDistributionFunction) {
  for (Real x = -37; x <= 0; x += 0.173) {
    const Real p = std::erfc(-x / std::sqrt(2.0)) / 2;
    EXPECT_NEAR(normal_quantile(p), x, 2e-15 * std::max(1.0, std::abs(x)) + 1e-15) << "p " << p;
  }
  EXPECT_EQ(normal_quantile(0.5), 0);
  for (Real p : {0.01, 0.06, 0.2, 0.45}) EXPECT_NEAR(normal_quantile(p), -normal_quantile(1 - p), 2e-14);
}

// A scene may have an angle of any size.
TEST(SinCos, IsAPointOfTheCircleForEveryFiniteAngle) {
  for (const Real x : {1.1e6, -1e9, 1e19, -5.6e36, 1e308}) {
    const SinCos sc = sincos(x);
    EXPECT_NEAR(sc.sin * sc.sin + sc.cos * sc.cos, 1, 1e-14) << x;
  }
}

TEST(SinCos, AgreesWithTheLibrary) {
  for (Real x = -1e6; x < 1e6; x += 77.7331) {
    const SinCos sc = sincos(x);
    ASSERT_NEAR(sc.sin, std::sin(x), 1e-15) << x;
    ASSERT_NEAR(sc.cos, std::cos(x), 1e-15) << x;
  }
  for (Real x = -10; x < 10; x += 0.00317) {
    ASSERT_NEAR(sincos(x).sin, std::sin(x), 4e-16) << x;
    ASSERT_NEAR(sincos(x).cos, std::cos(x), 4e-16) << x;
  }
}

}  // namespace
}  // namespace offstage::effects
