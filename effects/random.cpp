#include "effects/random.h"

#include <cmath>
#include <numbers>

namespace offstage::effects {
namespace {

/// Mixes bits with the finalizer of MurmurHash3 and the constants of SplitMix64. Every bit of the input
/// affects every bit of the output.
uint64_t mix(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

uint64_t random_bits(uint64_t seed, uint64_t stream, uint64_t index, uint32_t property) {
  const uint64_t key = combined(seed, stream);
  const auto low = [](uint64_t x) { return static_cast<uint32_t>(x); };
  const auto high = [](uint64_t x) { return static_cast<uint32_t>(x >> 32); };
  const auto words = philox({low(index), high(index), property, 0}, {low(key), high(key)});
  return uint64_t{words[1]} << 32 | words[0];
}

/// Returns c[0] + c[1] x + c[2] x^2 + ...
template <std::size_t N>
Real polynomial(const Real (&c)[N], Real x) {
  Real sum = c[N - 1];
  for (std::size_t i = N - 1; i-- > 0;) sum = sum * x + c[i];
  return sum;
}

/// Returns the natural logarithm of a positive normal number. It uses x = 2^k m with m near 1, and log m = 2
/// artanh((m - 1) / (m + 1)).
Real logarithm(Real x) {
  int k;
  Real m = std::frexp(x, &k);  // exact
  if (m < 0.70710678118654752) {
    m *= 2;
    --k;
  }
  const Real s = (m - 1) / (m + 1), s2 = s * s;
  constexpr Real kSeries[] = {1.0 / 3,  1.0 / 5,  1.0 / 7,  1.0 / 9,  1.0 / 11,
                              1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21};
  // log 2 in two parts. The first has trailing zeros, so that its product with k is exact.
  constexpr Real kLog2High = 0x1.62e42fee00000p-1, kLog2Low = 0x1.a39ef35793c76p-33;
  const Real artanh_rest = s * s2 * polynomial(kSeries, s2);
  return k * kLog2High + (2 * s + (2 * artanh_rest + k * kLog2Low));
}

}  // namespace

std::array<uint32_t, 4> philox(std::array<uint32_t, 4> c, std::array<uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const uint64_t p0 = uint64_t{0xD2511F53} * c[0], p1 = uint64_t{0xCD9E8D57} * c[2];
    c = {static_cast<uint32_t>(p1 >> 32) ^ c[1] ^ key[0], static_cast<uint32_t>(p1),
         static_cast<uint32_t>(p0 >> 32) ^ c[3] ^ key[1], static_cast<uint32_t>(p0)};
    key[0] += 0x9E3779B9;
    key[1] += 0xBB67AE85;
  }
  return c;
}

uint64_t stream_id(std::string_view name) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

uint64_t combined(uint64_t a, uint64_t b) {
  return mix(a ^ mix(b + 0x9e3779b97f4a7c15u));
}

Real RandomStream::uniform(uint64_t index, uint32_t property) const {
  const uint64_t bits = random_bits(seed_, stream_, index, property) >> 12;
  return (static_cast<Real>(bits) + 0.5) * 0x1p-52;
}

uint64_t RandomStream::below(uint64_t n, uint64_t index, uint32_t property) const {
  const auto product = static_cast<unsigned __int128>(random_bits(seed_, stream_, index, property)) * n;
  return static_cast<uint64_t>(product >> 64);
}

Permutation::Permutation(uint64_t n, uint64_t key) : n_(n), key_(key), half_bits_(1) {
  while (half_bits_ < 32 && (uint64_t{1} << (2 * half_bits_)) < n) ++half_bits_;
}

uint64_t Permutation::operator()(uint64_t i) const {
  const uint64_t mask = (uint64_t{1} << half_bits_) - 1;
  // The network permutes up to 4 n numbers. Starting at i, repeated application eventually gives a number
  // below n.
  do {
    uint64_t left = i >> half_bits_, right = i & mask;
    for (uint64_t round = 0; round < 6; ++round) {
      const uint64_t next = left ^ (mix(key_ ^ mix(right + (round << 32))) & mask);
      left = right;
      right = next;
    }
    i = left << half_bits_ | right;
  } while (i >= n_);
  return i;
}

// M. J. Wichura, "Algorithm AS 241: the percentage points of the normal distribution", Applied Statistics 37
// (1988).
Real normal_quantile(Real p) {
  constexpr Real kA[] = {3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                         1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                         3.3430575583588128105e4, 2.5090809287301226727e3};
  constexpr Real kB[] = {1.0,
                         4.2313330701600911252e1,
                         6.8718700749205790830e2,
                         5.3941960214247511077e3,
                         2.1213794301586595867e4,
                         3.9307895800092710610e4,
                         2.8729085735721942674e4,
                         5.2264952788528545610e3};
  constexpr Real kC[] = {1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                         3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                         2.27238449892691845833e-2, 7.74545014278341407640e-4};
  constexpr Real kD[] = {1.0,
                         2.05319162663775882187e0,
                         1.67638483018380384940e0,
                         6.89767334985100004550e-1,
                         1.48103976427480074590e-1,
                         1.51986665636164571966e-2,
                         5.47593808499534494600e-4,
                         1.05075007164441684324e-9};
  constexpr Real kE[] = {6.65790464350110377720e0,  5.46378491116411436990e0,  1.78482653991729133580e0,
                         2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
                         2.71155556874348757815e-5, 2.01033439929228813265e-7};
  constexpr Real kF[] = {1.0,
                         5.99832206555887937690e-1,
                         1.36929880922735805310e-1,
                         1.48753612908506148525e-2,
                         7.86869131145613259100e-4,
                         1.84631831751005468180e-5,
                         1.42151175831644588870e-7,
                         2.04426310338993978564e-15};
  const Real q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const Real r = 0.180625 - q * q;
    return q * polynomial(kA, r) / polynomial(kB, r);
  }
  const Real r = std::sqrt(-logarithm(q < 0 ? p : 1 - p));
  const Real x = r <= 5 ? polynomial(kC, r - 1.6) / polynomial(kD, r - 1.6)
                        : polynomial(kE, r - 5) / polynomial(kF, r - 5);
  return q < 0 ? -x : x;
}

SinCos sincos(Real x) {
  constexpr Real kFar = 1e6;
  if (std::abs(x) > kFar) x = std::fmod(x, 2 * std::numbers::pi);  // exact, with the same bits everywhere
  // Computes x - k pi/2 with pi/2 in three parts; the product of k and each of the first two is exact for |x|
  // < 1e6.
  constexpr Real kHalfPi1 = 0x1.921fb54400000p+0, kHalfPi2 = 0x1.0b4611a600000p-34,
                 kHalfPi3 = 0x1.3198a2e037073p-69;
  const Real k = std::floor(x * 0.63661977236758134 + 0.5);
  const Real r = ((x - k * kHalfPi1) - k * kHalfPi2) - k * kHalfPi3;

  // The remainders of the Taylor series on [-pi/4, pi/4] are below 1e-18.
  constexpr Real kSin[] = {1.0,
                           -1.0 / 6,
                           1.0 / 120,
                           -1.0 / 5040,
                           1.0 / 362880,
                           -1.0 / 39916800,
                           1.0 / 6227020800,
                           -1.0 / 1307674368000,
                           1.0 / 355687428096000};
  constexpr Real kCos[] = {1.0,
                           -1.0 / 2,
                           1.0 / 24,
                           -1.0 / 720,
                           1.0 / 40320,
                           -1.0 / 3628800,
                           1.0 / 479001600,
                           -1.0 / 87178291200,
                           1.0 / 20922789888000,
                           -1.0 / 6402373705728000};
  const Real s = r * polynomial(kSin, r * r), c = polynomial(kCos, r * r);
  switch (static_cast<int64_t>(k) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

}  // namespace offstage::effects
