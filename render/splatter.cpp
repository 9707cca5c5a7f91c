#include "render/splatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

constexpr int kLanes = 8;  // of a vector register
constexpr int kTileWidth_px = 64, kTileHeight_px = 16;
constexpr int kTilePixels = kTileWidth_px * kTileHeight_px;
constexpr float kHidden = 1.0f / 512;  // less of the background is as good as none
constexpr int kCheckEvery = 24;

struct Tile {
  alignas(32) std::array<float, kTilePixels> red{}, green{}, blue{}, through{}, depth{};
};

struct TileRange {
  int x0, y0, x1, y1;  // in tiles, the end not included
};

template <class S>
TileRange tiles_of(const S& s, const SplatPicture& picture) {
  const auto tile = [](float at, int size_px, int limit) {
    return static_cast<int>(
        std::clamp(std::floor(at / static_cast<float>(size_px)), -1.0f, static_cast<float>(limit)));
  };
  const int nx = (picture.width_px + kTileWidth_px - 1) / kTileWidth_px;
  const int ny = (picture.height_px + kTileHeight_px - 1) / kTileHeight_px;
  return {std::max(tile(s.x - s.half_x, kTileWidth_px, nx), 0),
          std::max(tile(s.y - s.half_y, kTileHeight_px, ny), 0),
          std::min(tile(s.x + s.half_x, kTileWidth_px, nx) + 1, nx),
          std::min(tile(s.y + s.half_y, kTileHeight_px, ny) + 1, ny)};
}

typedef float Lanes __attribute__((vector_size(4 * kLanes)));
typedef int32_t IntLanes __attribute__((vector_size(4 * kLanes)));

inline Lanes clamped(Lanes x, float low, float high) {
  const Lanes least = Lanes{} + low, most = Lanes{} + high;
  x = x > least ? x : least;
  return x < most ? x : most;
}

inline Lanes byte_of(IntLanes texel, int shift) {
  return __builtin_convertvector((texel >> shift) & 255, Lanes);
}

// The texels under eight pixels in a row, (dx, dy) being the first one's place from the centre.
inline IntLanes texels_at(const Splat& s, float dx, float dy) {
  const Lanes x = dx + Lanes{0, 1, 2, 3, 4, 5, 6, 7};
  const float half = 0.5f * static_cast<float>(s.cell.size_px), last = static_cast<float>(s.cell.size_px - 1);
  const Lanes u = clamped(half * (s.ux * x + (s.uy * dy + 1)), 0, last);
  const Lanes v = clamped(half * (s.vx * x + (s.vy * dy + 1)), 0, last);
  const IntLanes index =
      __builtin_convertvector(v, IntLanes) * s.cell.size_px + __builtin_convertvector(u, IntLanes);
  IntLanes texel;
  for (int i = 0; i < kLanes; ++i) texel[i] = static_cast<int32_t>(s.cell.texels[index[i]]);
  return texel;
}

inline Lanes square_root(Lanes x) {
  return __builtin_ia32_sqrtps256(x);
}

inline Lanes& lanes_of(std::array<float, kTilePixels>& plane, std::size_t at) {
  return *reinterpret_cast<Lanes*>(plane.data() + at);
}

inline void draw_lanes(const Splat& s, float dx, float dy, std::size_t at, Tile& tile) {
  const IntLanes texel = texels_at(s, dx, dy);
  const Lanes nx = byte_of(texel, 8), ny = byte_of(texel, 16), nz = byte_of(texel, 24);
  const Lanes in_front = clamped((lanes_of(tile.depth, at) - s.depth) * s.inverse_reach + 0.5f, 0, 1);
  Lanes& through = lanes_of(tile.through, at);
  const Lanes seen = through * (s.opacity * byte_of(texel, 0) * in_front);
  const auto add_light = [&](std::array<float, kTilePixels>& plane, const float* r) {
    const Lanes light = r[0] + r[1] * nx + r[2] * ny + r[3] * nz;
    lanes_of(plane, at) += seen * (light > 0.0f ? light : Lanes{});
  };
  add_light(tile.red, s.radiance[0]);
  add_light(tile.green, s.radiance[1]);
  add_light(tile.blue, s.radiance[2]);
  through -= seen * s.cover;
}

// Eight pixels in a row of a streak.
inline void draw_lanes(const StreakSplat& s, float dx, float dy, std::size_t at, Tile& tile) {
  const Lanes x = dx + Lanes{0, 1, 2, 3, 4, 5, 6, 7};
  const Lanes along = x * s.along_x + dy * s.along_y,
              across = (x * s.along_y - dy * s.along_x) * s.inverse_radius;
  const Lanes past = (along - clamped(along, -s.half_length, s.half_length)) * s.inverse_radius;
  const Lanes from_axis = square_root(past * past + across * across);
  const Lanes rim = clamped((from_axis - (1 - s.softness)) * (1 / s.softness), 0, 1);
  const Lanes in_front =
      clamped((lanes_of(tile.depth, at) - (s.depth + s.depth_slope * along)) * s.inverse_reach + 0.5f, 0, 1);
  const Lanes head = along / (s.half_length + 1 / s.inverse_radius);
  const Lanes tail = 1 - s.taper * (0.5f - 0.5f * clamped(head, -1, 1));
  Lanes& through = lanes_of(tile.through, at);
  const Lanes seen = through * (s.opacity * tail * in_front * (1 - rim * rim * (3 - 2 * rim)));
  // Fresnel's reflection by Schlick's approximation.
  const Lanes side = clamped(across, -1, 1);
  const Lanes m = 1 - square_root(1 - side * side), m2 = m * m;
  const Lanes mirrored = 0.02f + 0.98f * (m2 * m2 * m);
  const auto add_light = [&](std::array<float, kTilePixels>& plane, std::size_t c) {
    lanes_of(plane, at) +=
        seen *
        (s.light.middle[c] + mirrored * (s.light.rim[c] + s.light.rim_slope[c] * side - s.light.middle[c]));
  };
  add_light(tile.red, 0);
  add_light(tile.green, 1);
  add_light(tile.blue, 2);
  through -= seen * s.cover;
}

// The part of a row that a splat reaches, dy above its centre, as its left and right from the centre.
inline std::array<float, 2> span_of(const Splat& s, float) {
  return {-s.half_x, s.half_x};
}
inline std::array<float, 2> span_of(const StreakSplat& s, float dy) {
  const float steep = std::abs(s.along_y), radius = 1 / s.inverse_radius;
  if (steep * s.half_length < radius) return {-s.half_x, s.half_x};
  const float middle = dy * s.along_x / s.along_y, half = radius / steep;
  return {std::max(middle - half, -s.half_x), std::min(middle + half, s.half_x)};
}

template <class S>
void draw_splat(const S& s, int tile_x, int tile_y, Tile& tile) {
  const float left = s.x - static_cast<float>(tile_x), bottom = s.y - static_cast<float>(tile_y);
  const int y0 = std::max(static_cast<int>(std::ceil(bottom - s.half_y - 0.5f)), 0);
  const int y1 = std::min(static_cast<int>(std::floor(bottom + s.half_y - 0.5f)) + 1, kTileHeight_px);
  for (int y = y0; y < y1; ++y) {
    const float dy = static_cast<float>(y) + 0.5f - bottom;
    const auto [low, high] = span_of(s, dy);
    const int x0 = std::max(static_cast<int>(std::ceil(left + low - 0.5f)), 0) / kLanes * kLanes;
    const int x1 = std::min(static_cast<int>(std::floor(left + high - 0.5f)) + 1, kTileWidth_px);
    for (int x = x0; x < x1; x += kLanes) {
      draw_lanes(s, static_cast<float>(x) + 0.5f - left, dy, static_cast<std::size_t>(y * kTileWidth_px + x),
                 tile);
    }
  }
}

// Folds the bytes' scale into the numbers: cover is byte / 255, a normal byte / 127.5 - 1.
Splat in_bytes(Splat s) {
  s.opacity /= 255;
  for (auto& r : s.radiance) {
    r[0] -= r[1] + r[2] + r[3];
    for (std::size_t k = 1; k < 4; ++k) r[k] /= 127.5f;
  }
  return s;
}

bool is_covered(const Tile& tile) {
  std::array<float, kLanes> most{};
  for (std::size_t at = 0; at < kTilePixels; at += kLanes)
    for (std::size_t i = 0; i < kLanes; ++i) most[i] = std::max(most[i], tile.through[at + i]);
  return *std::max_element(most.begin(), most.end()) < kHidden;
}

template <class S>
void draw_tile(std::span<const S> splats, std::span<const uint32_t> order, int tile_x, int tile_y,
               SplatPicture& picture) {
  Tile tile;
  const int width = std::min(kTileWidth_px, picture.width_px - tile_x);
  const int height = std::min(kTileHeight_px, picture.height_px - tile_y);
  float farthest = 0;
  for (int y = 0; y < height; ++y) {
    const float* in =
        picture.depth.data() + static_cast<std::ptrdiff_t>(tile_y + y) * picture.width_px + tile_x;
    for (int x = 0; x < width; ++x) {
      const auto at = static_cast<std::size_t>(y * kTileWidth_px + x);
      tile.depth[at] = in[x];
      tile.through[at] = 1;
      farthest = std::max(farthest, in[x]);
    }
  }
  int since_check = 0;
  constexpr std::size_t kAhead = 4;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k + kAhead < order.size()) __builtin_prefetch(&splats[order[k + kAhead]]);
    const S& s = splats[order[k]];
    if ((farthest - s.depth) * s.inverse_reach <= -0.5f) continue;
    draw_splat(s, tile_x, tile_y, tile);
    if (++since_check < kCheckEvery) continue;
    since_check = 0;
    if (is_covered(tile)) break;
  }
  for (int y = 0; y < height; ++y) {
    float* out =
        picture.rgbt.data() + (static_cast<std::ptrdiff_t>(tile_y + y) * picture.width_px + tile_x) * 4;
    for (int x = 0; x < width; ++x, out += 4) {
      const auto at = static_cast<std::size_t>(y * kTileWidth_px + x);
      out[0] = tile.red[at];
      out[1] = tile.green[at];
      out[2] = tile.blue[at];
      out[3] = tile.through[at];
    }
  }
}

template <class S>
void draw_by_tiles(std::span<const S> splats, SplatPicture& picture) {
  picture.x0 = picture.y0 = picture.x1 = picture.y1 = 0;
  const int nx = (picture.width_px + kTileWidth_px - 1) / kTileWidth_px;
  const int ny = (picture.height_px + kTileHeight_px - 1) / kTileHeight_px;
  const auto pixels =
      static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px);
  picture.rgbt.resize(4 * pixels);

  std::vector<TileRange> ranges(splats.size());
  std::vector<uint32_t> begins(static_cast<std::size_t>(nx * ny) + 1, 0);
  TileRange touched{nx, ny, 0, 0};
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const TileRange r = ranges[i] = tiles_of(splats[i], picture);
    for (int y = r.y0; y < r.y1; ++y)
      for (int x = r.x0; x < r.x1; ++x) ++begins[static_cast<std::size_t>(y * nx + x) + 1];
    if (r.x0 < r.x1 && r.y0 < r.y1)
      touched = {std::min(touched.x0, r.x0), std::min(touched.y0, r.y0), std::max(touched.x1, r.x1),
                 std::max(touched.y1, r.y1)};
  }
  if (touched.x0 >= touched.x1) return;
  for (std::size_t t = 1; t < begins.size(); ++t) begins[t] += begins[t - 1];
  std::vector<uint32_t> orders(begins.back()), ends(begins.begin(), begins.end() - 1);
  for (uint32_t i = 0; i < splats.size(); ++i)
    for (int y = ranges[i].y0; y < ranges[i].y1; ++y)
      for (int x = ranges[i].x0; x < ranges[i].x1; ++x)
        orders[ends[static_cast<std::size_t>(y * nx + x)]++] = i;

  const int columns = touched.x1 - touched.x0, rows = touched.y1 - touched.y0;
  tbb::parallel_for(0, columns * rows, [&](int k) {
    const int x = touched.x0 + k % columns, y = touched.y0 + k / columns;
    const auto t = static_cast<std::size_t>(y * nx + x);
    draw_tile(splats, std::span<const uint32_t>(orders).subspan(begins[t], begins[t + 1] - begins[t]),
              x * kTileWidth_px, y * kTileHeight_px, picture);
  });
  picture.x0 = touched.x0 * kTileWidth_px;
  picture.y0 = touched.y0 * kTileHeight_px;
  picture.x1 = std::min(touched.x1 * kTileWidth_px, picture.width_px);
  picture.y1 = std::min(touched.y1 * kTileHeight_px, picture.height_px);
}

}  // namespace

void draw_splats(std::span<const Splat> front_to_back, SplatPicture& picture) {
  std::vector<Splat> splats(front_to_back.size());
  std::ranges::transform(front_to_back, splats.begin(), in_bytes);
  draw_by_tiles(std::span<const Splat>(splats), picture);
}
void draw_splats(std::span<const StreakSplat> front_to_back, SplatPicture& picture) {
  draw_by_tiles(front_to_back, picture);
}

}  // namespace offstage::render
