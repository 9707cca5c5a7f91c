#include "sim/dynamics/turbulence.h"

#include <algorithm>
#include <cmath>

#include <immintrin.h>

#include "sim/linear/lanes.h"

namespace offstage::sim {
namespace {

constexpr std::size_t kWidth = 8;
typedef float Floats __attribute__((vector_size(kWidth * sizeof(float))));
typedef uint32_t Words __attribute__((vector_size(kWidth * sizeof(uint32_t))));
typedef int32_t Ints __attribute__((vector_size(kWidth * sizeof(int32_t))));

/// Period of the lattice along each axis, in cells; a corner's index has 10 bits.
constexpr Real kTile = 1024;
/// The velocity of a corner consists of three integers from 0 to kLevels - 1. Each is 10 bits of a hash.
constexpr uint32_t kLevels = 1024;
/// Mean over a cell of sum |M|^2 with M = (w + (grad w . d)/2) 1 - d grad w^T / 2. It is the mean square of
/// the field for random velocities of variance 1 along each axis.
constexpr Real kMeanSquare = 1.0974211408;
/// 2^(-1/3). Eddies of half the width have kCascade times the speed and kCascade^2 times the lifetime.
constexpr Real kCascade = 0.79370052598409973738;

uint32_t mixed(uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return x ^ (x >> 16);
}

Real fade(Real t) {
  return t * t * t * (10 + t * (6 * t - 15));
}

/// Converts the numbers of two registers to one register of single precision.
Floats narrowed(Lanes low, Lanes high) {
  return _mm256_set_m128(_mm256_cvtpd_ps(high), _mm256_cvtpd_ps(low));
}
Words whole(Lanes low, Lanes high) {
  return Words(_mm256_set_m128i(_mm256_cvttpd_epi32(high), _mm256_cvttpd_epi32(low)));
}

/// Returns a b + c, rounded only once.
Floats product_sum(Floats a, Floats b, Floats c) {
  return _mm256_fmadd_ps(a, b, c);
}

/// One axis at eight points. For the low and the high corner of each point's cell, it has the distance of the
/// point from the corner, the weight of the corner, and half the derivative of the weight.
struct Axis {
  Floats offset[2], weight[2], slope[2];
  Words index[2];

  Axis(const Real* x, Real cells, Real origin) {
    Lanes fraction[2], cell[2];
    for (int half = 0; half < 2; ++half, x += 12) {
      const Lanes u = Lanes{x[0], x[3], x[6], x[9]} * cells - origin;
      const Lanes low = _mm256_floor_pd(u), tile = _mm256_floor_pd(low * (1 / kTile));
      fraction[half] = u - low;
      cell[half] = low - kTile * tile;
    }
    const Floats t = narrowed(fraction[0], fraction[1]), edge = t * (t - 1);
    index[0] = whole(cell[0], cell[1]);
    index[1] = (index[0] + 1) & (static_cast<uint32_t>(kTile) - 1);
    offset[0] = t;
    offset[1] = t - 1;
    weight[1] = t * t * t * (10 + t * (6 * t - 15));
    weight[0] = 1 - weight[1];
    slope[1] = 15 * edge * edge;
    slope[0] = -slope[1];
  }
};

/// Returns the current random velocities at eight corners. The hash is Wellons' lowbias32. The key is added
/// in the middle of the hash, so both ticks share the first half of the computation.
std::array<Floats, 3> corner_velocity(const EddyLattice& o, Words x, Words y, Words z) {
  Words hash = x | (y << 10) | (z << 20);
  hash = (hash ^ (hash >> 16)) * 0x7feb352du;
  const Floats bias = Floats{} + o.bias;
  std::array<Floats, 3> a = {bias, bias, bias};
  for (std::size_t tick = 0; tick < 2; ++tick) {
    Words h = hash ^ o.key[tick];
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    h ^= h >> 16;
    for (Floats& v : a) {
      v = product_sum(Floats{} + o.fraction[tick], __builtin_convertvector(Ints(h & (kLevels - 1)), Floats),
                      v);
      h >>= 10;
    }
  }
  return a;
}

}  // namespace

TurbulentFlow::TurbulentFlow(const Turbulence& f, Real time) : octave_count_(f.octaves) {
  Real total = 0, square = 1;
  for (uint32_t k = 0; k < octave_count_; ++k, square *= kCascade * kCascade) total += square;
  // The variance of an integer from 0 to n - 1 is (n^2 - 1) / 12.
  Real speed = f.speed / std::sqrt(total * kMeanSquare * (kLevels * Real{kLevels} - 1) / 12);
  Real cells = 1 / f.scale;
  Real rate = f.lifetime > 0 ? 1 / f.lifetime : f.speed / f.scale;
  for (uint32_t k = 0; k < octave_count_; ++k) {
    const Real age = time * rate, whole = std::floor(age), late = fade(age - whole), early = 1 - late;
    const uint32_t stream = mixed(f.seed * Turbulence::kMaxOctaves + k);
    const auto tick = static_cast<uint32_t>(static_cast<int64_t>(std::clamp(whole, -0x1p62, 0x1p62)));
    EddyLattice& o = octaves_[k];
    o.cells = cells;
    // Random offsets move the lattices of the octaves, so that they have no corner in common.
    o.origin = time * cells * f.drift;
    for (int i = 0; i < 3; ++i)
      o.origin[i] += mixed(stream + 1 + static_cast<uint32_t>(i)) * (kTile / 0x1p32);
    // The squares of the fractions have a constant sum, so the air does not calm down between two ticks.
    const Real norm = speed / std::sqrt(late * late + early * early);
    o.key = {mixed(stream ^ mixed(tick)), mixed(stream ^ mixed(tick + 1))};
    o.fraction = {static_cast<float>(norm * early), static_cast<float>(norm * late)};
    o.bias = -(o.fraction[0] + o.fraction[1]) * (kLevels - 1) / 2;
    speed *= kCascade;
    cells *= 2;
    rate /= kCascade * kCascade;
  }
}

void TurbulentFlow::velocity8(const Real* points, Real* out) const {
  Floats sum[3] = {};
  for (uint32_t k = 0; k < octave_count_; ++k) {
    const EddyLattice& o = octaves_[k];
    const Axis x(points, o.cells, o.origin.x()), y(points + 1, o.cells, o.origin.y()),
        z(points + 2, o.cells, o.origin.z());
#pragma GCC unroll 8
    for (int corner = 0; corner < 8; ++corner) {
      const int i = corner & 1, j = (corner >> 1) & 1, l = corner >> 2;
      const Floats dx = x.offset[i], dy = y.offset[j], dz = z.offset[l];
      const std::array<Floats, 3> a = corner_velocity(o, x.index[i], y.index[j], z.index[l]);
      const Floats xy = x.weight[i] * y.weight[j];
      const Floats grad_x = x.slope[i] * y.weight[j] * z.weight[l],
                   grad_y = x.weight[i] * y.slope[j] * z.weight[l], grad_z = xy * z.slope[l];
      const Floats along =
          product_sum(xy, z.weight[l], product_sum(grad_x, dx, product_sum(grad_y, dy, grad_z * dz)));
      const Floats back = product_sum(grad_x, -a[0], product_sum(grad_y, -a[1], grad_z * -a[2]));
      sum[0] = product_sum(along, a[0], product_sum(back, dx, sum[0]));
      sum[1] = product_sum(along, a[1], product_sum(back, dy, sum[1]));
      sum[2] = product_sum(along, a[2], product_sum(back, dz, sum[2]));
    }
  }
  for (std::size_t i = 0; i < kWidth; ++i)
    for (std::size_t c = 0; c < 3; ++c) out[3 * i + c] = Real{sum[c][i]};
}

void TurbulentFlow::velocity(std::span<const Real> points, std::span<Real> out) const {
  constexpr std::size_t kRun = 3 * kWidth;
  std::size_t i = 0;
  for (; i + kRun <= points.size(); i += kRun) velocity8(&points[i], &out[i]);
  if (i == points.size()) return;
  std::array<Real, kRun> rest{}, rest_out;
  std::copy(points.begin() + static_cast<std::ptrdiff_t>(i), points.end(), rest.begin());
  velocity8(rest.data(), rest_out.data());
  std::copy_n(rest_out.begin(), points.size() - i, out.begin() + static_cast<std::ptrdiff_t>(i));
}

Vec3 TurbulentFlow::velocity(const Vec3& point) const {
  Vec3 out;
  velocity({point.data(), 3}, {out.data(), 3});
  return out;
}

}  // namespace offstage::sim
