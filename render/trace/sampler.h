#pragma once
/// Private: low-discrepancy samples for the pixels of a sub-frame. Pixels are numbered along a Morton curve.
/// In this order, each pixel takes the next samples of one Sobol sequence. The samples of neighbouring pixels
/// and of all sub-frames therefore complement each other (A. Ahmed and P. Wonka, "Screen-Space Blue-Noise
/// Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels", 2020). Order and values are
/// scrambled per dimension (B. Burley, "Practical Hash-based Owen Scrambling", 2020).

#include <bit>
#include <cstdint>
#include <type_traits>

#include "render/lanes.h"

namespace offstage::render {

/// A point in the unit square, or eight of them.
template <class F>
struct SquarePoint {
  F x, y;
};

/// One sample of a pixel or ray: a sequence of pairs of coordinates. U: uint32_t for one pixel, or UintLanes
/// for eight pixels.
template <class U>
class Sampler {
 public:
  using F = std::conditional_t<std::is_same_v<U, uint32_t>, float, Lanes>;

  /// Starts sample `index` of `count` samples of the pixel (x, y). x and y must be below 65536.
  Sampler(U x, U y, int index, int count) : Sampler(spread(x) | spread(y) << 1, index, count) {}
  /// Starts sample `index` of `count` samples of a ray. Rays should be numbered from 0 without gaps.
  Sampler(U number, int index, int count)
      : reversed_index_(
            reversed(number * std::bit_ceil(static_cast<uint32_t>(count)) + static_cast<uint32_t>(index))) {}

  /// Returns the next two coordinates, each in [0, 1).
  SquarePoint<F> next() {
    const uint32_t salt = mixed(++pairs_);
    const U k = reversed(permuted(reversed_index_, salt));
    // The Sobol points are the reversed bits of k and of pascal(k); scrambling starts from reversed bits.
    return {fraction(reversed(permuted(k, salt * 0x9E3779B1u))),
            fraction(reversed(permuted(pascal(k), salt * 0x85EBCA77u)))};
  }
  /// Skips pairs of coordinates.
  void skip(uint32_t pairs) { pairs_ += pairs; }

 private:
  static F fraction(U v) {
    if constexpr (std::is_same_v<U, uint32_t>)
      return static_cast<float>(v >> 8) * 0x1p-24f;
    else
      return __builtin_convertvector(reinterpret_cast<IntLanes>(v >> 8), Lanes) * 0x1p-24f;
  }
  // Inserts a zero bit behind each bit.
  static U spread(U v) {
    v = (v | v << 8) & 0x00FF00FFu;
    v = (v | v << 4) & 0x0F0F0F0Fu;
    v = (v | v << 2) & 0x33333333u;
    return (v | v << 1) & 0x55555555u;
  }
  static U reversed(U v) {
    v = v << 24 | (v & 0xFF00u) << 8 | (v >> 8 & 0xFF00u) | v >> 24;
    v = (v & 0x0F0F0F0Fu) << 4 | (v >> 4 & 0x0F0F0F0Fu);
    v = (v & 0x33333333u) << 2 | (v >> 2 & 0x33333333u);
    return (v & 0x55555555u) << 1 | (v >> 1 & 0x55555555u);
  }
  // Computes the second dimension of the Sobol sequence. Its generator matrix is Pascal's triangle modulo 2,
  // which is a Kronecker power of [1 1; 0 1].
  static U pascal(U v) {
    v ^= v >> 1 & 0x55555555u;
    v ^= v >> 2 & 0x33333333u;
    v ^= v >> 4 & 0x0F0F0F0Fu;
    v ^= v >> 8 & 0x00FF00FFu;
    return v ^ (v >> 16);
  }
  static uint32_t mixed(uint32_t v) {
    v = (v ^ v >> 16) * 0x7FEB352Du;
    v = (v ^ v >> 15) * 0x846CA68Bu;
    return v ^ v >> 16;
  }
  // Changes each bit by a hash of the lower bits. If the bits are reversed before and after, this is an Owen
  // scrambling: it permutes the halves of [0, 2^32) recursively.
  static U permuted(U v, uint32_t salt) {
    v ^= v * 0x3D20ADEAu;
    v += salt;
    v *= (salt >> 16) | 1;
    v ^= v * 0x05526C56u;
    return v ^ v * 0x53A22864u;
  }

  U reversed_index_;
  uint32_t pairs_ = 0;
};

using PixelSampler = Sampler<uint32_t>;

/// Selects one of a sequence of items with a probability in proportion to its weight. It needs one random
/// number in [0, 1).
class WeightedChoice {
 public:
  explicit WeightedChoice(float random) : random_(random) {}
  /// Offers the next item. Returns true if it replaces the selected item. `weight` must be positive.
  bool take(float weight) {
    sum_ += weight;
    const float chance = weight / sum_;
    const bool taken = random_ < chance;
    random_ = taken ? random_ / chance : (random_ - chance) / (1 - chance);
    if (taken) weight_ = weight;
    return taken;
  }
  float weight() const { return weight_; }  ///< weight of the selected item
  float sum() const { return sum_; }        ///< sum of all weights
  /// Returns a random number in [0, 1) that is independent of the selection.
  float rest() const { return random_ < 0 ? 0.0f : random_ < 1 ? random_ : 0x1.fffffep-1f; }

 private:
  float random_, sum_ = 0, weight_ = 0;
};

}  // namespace offstage::render
