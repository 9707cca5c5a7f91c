#pragma once
/// Counter-based random numbers: Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3",
/// 2011). A number depends only on (seed, stream, index, property), so a new property never reshuffles the
/// others and the order of evaluation does not matter. No std:: distribution is used: their bits differ
/// between libraries.

#include <array>
#include <cstdint>
#include <string_view>

#include "sim/core/types.h"

namespace offstage::effects {

using sim::Real;
using sim::Vec3;

/// The Philox4x32-10 bijection.
std::array<uint32_t, 4> philox(std::array<uint32_t, 4> counter, std::array<uint32_t, 2> key);

/// Stable 64-bit name of a stream, from an object's name (FNV-1a).
uint64_t stream_id(std::string_view name);

/// Combines two numbers to a well-mixed one: the index of objects that are identified by two numbers, such as
/// the child of a particle.
uint64_t combined(uint64_t a, uint64_t b);

/// The random numbers of one object's stream: pure functions of (index, property).
class RandomStream {
 public:
  RandomStream(uint64_t seed, uint64_t stream) : seed_(seed), stream_(stream) {}

  /// Uniform in the open interval (0, 1), 52 bits. `index` counts particles or releases, `property` is the
  /// purpose of the number.
  Real uniform(uint64_t index, uint32_t property) const;
  /// Uniform integer in [0, n), n > 0.
  uint64_t below(uint64_t n, uint64_t index, uint32_t property) const;

 private:
  uint64_t seed_, stream_;
};

/// A pseudo-random permutation of [0, n). Each element is computed in O(1), by a Feistel network with cycle
/// walking.
class Permutation {
 public:
  Permutation(uint64_t n, uint64_t key);
  uint64_t operator()(uint64_t i) const;

 private:
  uint64_t n_, key_;
  uint32_t half_bits_;
};

/// Inverse of the standard normal distribution function for p in (0, 1): Wichura's AS 241, relative error
/// 1e-16. Uses only + - * / and sqrt, so its bits are the same everywhere.
Real normal_quantile(Real p);

/// sin and cos of a finite x by range reduction and polynomials, error under 1e-15 for |x| < 1e6; same bits
/// everywhere. Larger x are reduced by the double nearest to 2 pi.
struct SinCos {
  Real sin, cos;
};
SinCos sincos(Real x);

}  // namespace offstage::effects
