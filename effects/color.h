#pragma once
/// Colour and size of particles over their age (physics F4), and random initial colours (F2).

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "effects/random.h"

namespace offstage::effects {

using Rgba = Eigen::Vector4f;  ///< linear, straight alpha; values above 1 glow

/// A piecewise linear function of the normalized age (age divided by lifespan, 0 to 1). It is constant before
/// the first and after the last key.
template <class T>
struct AgeRamp {
  struct Key {
    Real age = 0;
    T value;
  };
  std::vector<Key> keys;  ///< ascending ages; must not be empty when evaluated

  T at(Real age) const {
    if (age <= keys.front().age) return keys.front().value;
    for (std::size_t i = 1; i < keys.size(); ++i) {
      if (age > keys[i].age) continue;
      const Real span = keys[i].age - keys[i - 1].age;
      const float w = span > 0 ? static_cast<float>((age - keys[i - 1].age) / span) : 1.f;
      return keys[i - 1].value * (1 - w) + keys[i].value * w;
    }
    return keys.back().value;
  }
};

using ColorRamp = AgeRamp<Rgba>;
using SizeRamp = AgeRamp<float>;

enum class RampKind {
  linear,
  smooth,  ///< continuous slope, without overshoot
};

/// Returns a slope at the middle of three keys for which a cubic does not overshoot: 0 at an extremum,
/// otherwise the weighted harmonic mean of the slopes of the two segments (Fritsch and Butland, "A method for
/// constructing local monotone piecewise cubic interpolants", 1984). h0, h1: lengths of the segments; s0, s1:
/// their slopes.
inline float monotone_slope(float h0, float h1, float s0, float s1) {
  if (!(s0 * s1 > 0)) return 0;
  const float w0 = 2 * h1 + h0, w1 = h1 + 2 * h0;
  return (w0 + w1) / (w0 / s0 + w1 / s1);
}
inline Rgba monotone_slope(float h0, float h1, const Rgba& s0, const Rgba& s1) {
  Rgba slope;
  for (int i = 0; i < 4; ++i) slope[i] = monotone_slope(h0, h1, s0[i], s1[i]);
  return slope;
}

/// A ramp prepared for fast evaluation: a table finds the segment of an age, where a cubic is evaluated. The
/// result is exact, also at steps (two keys of the same age).
template <class T>
class Ramp {
 public:
  /// Prepares a ramp, whose keys must not be empty.
  explicit Ramp(const AgeRamp<T>& ramp, RampKind kind = RampKind::linear) {
    const auto& keys = ramp.keys;
    const T zero = T(keys.front().value * 0.f);
    pieces_.push_back({keys.front().age, 0, keys.front().value, zero, zero, zero});
    for (std::size_t i = 0; i + 1 < keys.size(); ++i)
      if (keys[i + 1].age > keys[i].age) pieces_.push_back(piece(keys, i, kind == RampKind::smooth));
    pieces_.push_back({keys.back().age, 0, keys.back().value, zero, zero, zero});
    for (std::size_t b = 0; b < kBuckets; ++b) {
      std::size_t i = 0;
      while (i + 1 < pieces_.size() && pieces_[i + 1].start < static_cast<Real>(b) / kBuckets) ++i;
      first_[b] = static_cast<uint32_t>(i);
    }
  }

  T at(Real age) const {
    const auto bucket = static_cast<std::size_t>(std::clamp(age, 0.0, 1.0) * (kBuckets - 1));
    std::size_t i = first_[bucket];
    while (i + 1 < pieces_.size() && pieces_[i + 1].start < age) ++i;
    const Piece& p = pieces_[i];
    const auto x = static_cast<float>(age - p.start) * p.inverse_span;
    return p.value + x * (p.c1 + x * (p.c2 + x * p.c3));
  }

  /// Computes the value at the normalized age of every particle. The three spans have the same length.
  void evaluate(std::span<const Real> age, std::span<const Real> lifespan, std::span<T> values) const {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = at(age[i] / lifespan[i]);
  }

 private:
  static constexpr std::size_t kBuckets = 64;
  using Keys = std::vector<typename AgeRamp<T>::Key>;

  /// A cubic over (start, next start], in fractions of its span; constant before the first key and after the
  /// last one.
  struct Piece {
    Real start;
    float inverse_span;
    T value, c1, c2, c3;
  };

  static float span_of(const Keys& k, std::size_t i) { return static_cast<float>(k[i + 1].age - k[i].age); }
  static T slope_of(const Keys& k, std::size_t i) { return (k[i + 1].value - k[i].value) / span_of(k, i); }

  /// Returns the slope at key i of the cubics on both sides. It is zero at the first and last key and next to
  /// a step.
  static T slope_at(const Keys& k, std::size_t i) {
    const bool inside = i > 0 && i + 1 < k.size() && span_of(k, i - 1) > 0 && span_of(k, i) > 0;
    if (!inside) return T(k[i].value * 0.f);
    return monotone_slope(span_of(k, i - 1), span_of(k, i), slope_of(k, i - 1), slope_of(k, i));
  }

  static Piece piece(const Keys& k, std::size_t i, bool smooth) {
    const float h = span_of(k, i);
    const T rise = k[i + 1].value - k[i].value, zero = T(rise * 0.f);
    if (!smooth) return {k[i].age, 1 / h, k[i].value, rise, zero, zero};
    const T m0 = h * slope_at(k, i), m1 = h * slope_at(k, i + 1);
    return {k[i].age, 1 / h, k[i].value, m0, 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise};
  }

  std::vector<Piece> pieces_;
  std::array<uint32_t, kBuckets> first_;  // first piece to check, by age
};

/// The initial colour of particles: each channel is normally distributed about its mean, truncated at one
/// deviation and at 0.
struct StartColor {
  Rgba mean = Rgba::Ones();
  Rgba deviation = Rgba::Zero();  ///< >= 0
  /// Standard deviation of a random factor with the mean 1, by which red, green and blue are multiplied.
  float brightness_deviation = 0;

  /// Returns the colour of the particle with this id. It depends only on the id and the stream, so it need
  /// not be stored.
  Rgba of(const RandomStream& random, uint64_t id) const;
};

}  // namespace offstage::effects
