#include "render/puff_atlas.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

using Eigen::Vector3f;

uint32_t scramble(uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7FEB352Du;
  x = (x ^ (x >> 15)) * 0x846CA68Bu;
  return x ^ (x >> 16);
}

float lattice(int x, int y, int z, uint32_t seed) {
  const uint32_t key = static_cast<uint32_t>(x) * 0x8DA6B343u + static_cast<uint32_t>(y) * 0xD8163841u +
                       static_cast<uint32_t>(z) * 0xCB1AB31Fu + seed;
  return static_cast<float>(scramble(key) >> 8) * 0x1p-23f - 1;
}

// Returns noise in [-1, 1] whose details have a size of about 1.
float noise(const Vector3f& p, uint32_t seed) {
  const Vector3f base = p.array().floor();
  const Vector3f f = p - base;
  const Vector3f w = (f.array() * f.array() * (3 - 2 * f.array())).matrix();
  const int x = static_cast<int>(base.x()), y = static_cast<int>(base.y()), z = static_cast<int>(base.z());
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const auto row = [&](int dy, int dz) {
    return mix(lattice(x, y + dy, z + dz, seed), lattice(x + 1, y + dy, z + dz, seed), w.x());
  };
  return mix(mix(row(0, 0), row(1, 0), w.y()), mix(row(0, 1), row(1, 1), w.y()), w.z());
}

// Returns the density of a puff at a point of the unit ball; at most about 1.
float density(PuffAtlas::Kind kind, const Vector3f& p, uint32_t seed) {
  const bool flame = kind == PuffAtlas::Kind::flame;
  const float r = p.norm();
  if (r >= 1) return 0;
  // Billows: the folds of the noise point outwards in smoke and are stretched along Y in flames.
  const Vector3f q = flame ? Vector3f(3.2f * p.x(), 1.7f * p.y(), 3.2f * p.z()) : Vector3f(2.3f * p);
  float sum = 0, amplitude = 1, scale = 1;
  for (uint32_t octave = 0; octave < 4; ++octave, amplitude *= 0.52f, scale *= 2.07f) {
    const float n = noise(scale * q + Vector3f::Constant(17.3f * static_cast<float>(octave)), seed + octave);
    sum += amplitude * (flame ? 1 - 2.2f * std::abs(n) : 0.9f * n);
  }
  const float rim = 1 - r;
  const float body = (flame ? 1.5f : 1.7f) * rim + (flame ? 0.45f : 0.75f) * sum - (flame ? 0.45f : 0.35f);
  const float guard = std::min(rim / 0.25f, 1.0f);
  return std::clamp(body, 0.0f, 1.0f) * guard * guard * (3 - 2 * guard);
}

uint32_t pack(float cover, const Vector3f& normal) {
  const auto byte = [](float x) { return static_cast<uint32_t>(std::clamp(x, 0.0f, 255.0f) + 0.5f); };
  return byte(255 * cover) | byte(127.5f * normal.x() + 127.5f) << 8 |
         byte(127.5f * normal.y() + 127.5f) << 16 | byte(127.5f * normal.z() + 127.5f) << 24;
}

uint32_t mean(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  uint32_t result = 0;
  for (int shift = 0; shift < 32; shift += 8) {
    const uint32_t sum = (a >> shift & 255) + (b >> shift & 255) + (c >> shift & 255) + (d >> shift & 255);
    result |= (sum + 2) / 4 << shift;
  }
  return result;
}

std::vector<uint32_t> half_float(const std::vector<uint32_t>& fine, int fine_size) {
  const int size = fine_size / 2;
  std::vector<uint32_t> result(static_cast<std::size_t>(size * size));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const auto at = [&](int dx, int dy) {
        return fine[static_cast<std::size_t>((2 * y + dy) * fine_size + 2 * x + dx)];
      };
      const bool border = x == 0 || y == 0 || x == size - 1 || y == size - 1;
      const uint32_t value = mean(at(0, 0), at(1, 0), at(0, 1), at(1, 1));
      result[static_cast<std::size_t>(y * size + x)] = border ? value & 0xFFFFFF00u : value;
    }
  }
  return result;
}

}  // namespace

PuffAtlas::Picture PuffAtlas::make_picture(Kind kind, uint32_t seed) {
  constexpr int n = kFinest_px, kSlices = 20;
  constexpr float kDensity = 4.5f, kStep = 2.0f / kSlices;
  const auto place = [](int i, int count) {
    return (2 * static_cast<float>(i) + 1) / static_cast<float>(count) - 1;
  };
  std::vector<float> lump(static_cast<std::size_t>(n * n * kSlices));
  const auto at = [&](int x, int y, int z) -> float& {
    return lump[static_cast<std::size_t>((z * n + y) * n + x)];
  };
  for (int z = 0; z < kSlices; ++z)
    for (int y = 1; y < n - 1; ++y)
      for (int x = 1; x < n - 1; ++x)
        at(x, y, z) = density(kind, {place(x, n), place(y, n), place(z, kSlices)}, seed);

  Picture picture;
  picture.levels[0].assign(static_cast<std::size_t>(n * n), pack(0, Vector3f::UnitZ()));
  constexpr int d = 3;  // distance over which slopes are computed
  for (int y = d; y < n - d; ++y) {
    for (int x = d; x < n - d; ++x) {
      // The front of a puff hides its back, for the opacity and for the normal.
      float through = 1;
      Vector3f slope = Vector3f::Zero();
      for (int z = kSlices - 2; z > 0; --z) {
        const float seen = through * (1 - std::exp(-kDensity * kStep * at(x, y, z)));
        through -= seen;
        slope += seen * Vector3f((at(x - d, y, z) - at(x + d, y, z)) * (0.5f * n / (2 * d)),
                                 (at(x, y - d, z) - at(x, y + d, z)) * (0.5f * n / (2 * d)),
                                 (at(x, y, z - 1) - at(x, y, z + 1)) * (0.5f / kStep));
      }
      const float u = place(x, n), v = place(y, n);
      const Vector3f ball(u, v, std::sqrt(std::max(1 - u * u - v * v, 0.0f)));
      const Vector3f normal = (0.8f * ball + 0.45f * slope + 0.1f * Vector3f::UnitZ()).normalized();
      picture.levels[0][static_cast<std::size_t>(y * n + x)] = pack(1 - through, normal);
    }
  }
  for (std::size_t k = 1; k < kLevels; ++k)
    picture.levels[k] = half_float(picture.levels[k - 1], n >> (k - 1));
  return picture;
}

PuffAtlas::PuffAtlas() {
  tbb::parallel_for(std::size_t{0}, pictures_.size(), [this](std::size_t k) {
    pictures_[k] =
        make_picture(k < kVariants ? Kind::smoke : Kind::flame, scramble(static_cast<uint32_t>(k)));
  });
  for (std::size_t k = 0; k < pictures_.size(); ++k) {
    double sum = 0;
    for (const uint32_t texel : pictures_[k].levels[0]) sum += texel & 255;
    mean_cover_[k / kVariants] += static_cast<float>(sum / (255.0 * kVariants * kFinest_px * kFinest_px));
  }
}

PuffAtlas::Level PuffAtlas::level(Kind kind, int variant, float diameter_px) const {
  const Picture& picture =
      pictures_[static_cast<std::size_t>(kind) * kVariants + static_cast<std::size_t>(variant)];
  std::size_t k = 0;
  while (k + 1 < kLevels && static_cast<float>(kFinest_px >> (k + 1)) >= diameter_px) ++k;
  return {picture.levels[k].data(), kFinest_px >> k};
}

}  // namespace offstage::render
