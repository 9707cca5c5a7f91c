#pragma once
/// Pseudo-random numbers (SplitMix64) for tests of libraries that have no random numbers.

#include <cstdint>

namespace offstage {

struct Scatter {
  uint64_t seed = 0;

  /// Returns a number in [0, 1) that depends only on the seed and both arguments.
  double uniform(uint64_t i, uint64_t k) const {
    uint64_t x = 0x9e3779b97f4a7c15u * (seed * 1'000'003 + i * 64 + k + 1);
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
  }
};

}  // namespace offstage
