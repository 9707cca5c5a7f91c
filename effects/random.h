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

/// Returns a 64-bit identifier of a stream for an object's name: its FNV-1a hash.
uint64_t stream_id(std::string_view name);

/// Returns a hash of two numbers: the index of an object that is identified by two numbers, for example the
/// child of a particle.
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
/// 1e-16. Uses only + - * / and sqrt, so the result is bitwise identical on all machines.
Real normal_quantile(Real p);

/// Sine and cosine of a finite x [rad], by range reduction and polynomials. The result is bitwise identical
/// on all machines, with an error below 1e-15 for |x| < 1e6. Larger x are reduced with the double nearest to
/// 2 pi and are less accurate.
struct SinCos {
  Real sin, cos;
};
SinCos sincos(Real x);

}  // namespace offstage::effects
