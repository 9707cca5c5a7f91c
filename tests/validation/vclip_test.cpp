/// V-Clip compared with brute force and with GJK, with cold and warm starts, in positions that are difficult
/// for distance algorithms.

#include "sim/collision/vclip.h"

#include <gtest/gtest.h>

#include "sim/collision/gjk.h"
#include "tests/convex_samples.h"

namespace offstage::sim {
namespace {

/// Checks pairs of consecutive seeds: V-Clip from a cold start, and from the features of a nearby pose,
/// agrees with the exact result and with GJK, relative to the size.
void expect_agreement(uint64_t seed, int pairs, uint32_t points) {
  constexpr Real kTolerance = 1e-9;
  for (int k = 0; k < pairs; ++k, ++seed) {
    Dice dice(seed);
    const ConvexPair pair = random_pair(dice, points);
    const Separation exact = pair.exact();
    VclipCache cache;
    GjkCache fresh;
    const Pose nearby{pair.a_from_b.position + 0.01 * pair.size() * dice.in_cube(),
                      pair.a_from_b.orientation};
    const Separation cold = vclip(pair.a, pair.b, pair.a_from_b, cache);
    vclip(pair.a, pair.b, nearby, cache);
    const Separation warm = vclip(pair.a, pair.b, pair.a_from_b, cache),
                     other = gjk(convex(pair.a), convex(pair.b), pair.a_from_b, fresh);
    for (const Separation& s : {cold, warm}) {
      ASSERT_TRUE(s.converged) << "seed " << seed;
      ASSERT_NEAR(s.distance, exact.distance, kTolerance * pair.size()) << "seed " << seed;
      ASSERT_NEAR(s.distance, other.distance, kTolerance * pair.size()) << "seed " << seed;
      ASSERT_NEAR(s.normal.norm(), 1, 1e-12) << "seed " << seed;
      ASSERT_LT((s.on_a - s.on_b - s.distance * s.normal).norm(), kTolerance * pair.size())
          << "seed " << seed;
      // The normal of separate solids is unique. Where faces of a hull are flat only to 1e-10, the error of
      // the normal is the square root of that.
      if (s.distance > 1e-3 * pair.size()) {
        ASSERT_LT((s.normal - exact.normal).norm(), 1e-5) << "seed " << seed;
      }
    }
  }
}

TEST(VclipAgainstBruteForce, SmallHulls) {
  expect_agreement(1, 10000, 12);
}
TEST(VclipAgainstBruteForce, LargeHulls) {
  expect_agreement(100001, 500, 100);
}
TEST(LongVclipAgainstBruteForce, HundredThousandPairs) {
  expect_agreement(200001, 100000, 30);
}

}  // namespace
}  // namespace offstage::sim
