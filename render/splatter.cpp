#include "render/splatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <tbb/parallel_for.h>

#include "render/lanes.h"

namespace offstage::render {
namespace {

constexpr int kTileWidth_px = 64, kTileHeight_px = 16;
constexpr int kTilePixels = kTileWidth_px * kTileHeight_px;
/// The background counts as hidden if less than this fraction of it is visible.
constexpr float kHidden = 1.0f / 512;
constexpr int kCheckEvery = 24;

struct Tile {
  alignas(32) std::array<float, kTilePixels> red{}, green{}, blue{}, through{}, depth{};
};

struct TileRange {
  int x0, y0, x1, y1;  // range of tiles; x1 and y1 are excluded
};

template <class S>
TileRange tiles_of(const S& s, int nx, int ny) {
  const auto tile = [](float at, int size_px, int limit) {
    return static_cast<int>(
        std::clamp(std::floor(at / static_cast<float>(size_px)), -1.0f, static_cast<float>(limit)));
  };
  return {std::max(tile(s.x - s.half_x, kTileWidth_px, nx), 0),
          std::max(tile(s.y - s.half_y, kTileHeight_px, ny), 0),
          std::min(tile(s.x + s.half_x, kTileWidth_px, nx) + 1, nx),
          std::min(tile(s.y + s.half_y, kTileHeight_px, ny) + 1, ny)};
}

inline Lanes byte_of(IntLanes texel, int shift) {
  return __builtin_convertvector((texel >> shift) & 255, Lanes);
}

// The texels under eight pixels in a row; (dx, dy) is the position of the first one relative to the centre.
inline IntLanes texels_at(const Splat& s, float dx, float dy) {
  const Lanes x = dx + Lanes{0, 1, 2, 3, 4, 5, 6, 7};
  const float half = 0.5f * static_cast<float>(s.cell.size_px), last = static_cast<float>(s.cell.size_px - 1);
  const Lanes u = clamped_to(half * (s.ux * x + (s.uy * dy + 1)), 0, last);
  const Lanes v = clamped_to(half * (s.vx * x + (s.vy * dy + 1)), 0, last);
  const IntLanes index =
      __builtin_convertvector(v, IntLanes) * s.cell.size_px + __builtin_convertvector(u, IntLanes);
  IntLanes texel;
  for (int i = 0; i < kLanes; ++i) texel[i] = static_cast<int32_t>(s.cell.texels[index[i]]);
  return texel;
}

inline Lanes& lanes_of(std::array<float, kTilePixels>& plane, std::size_t at) {
  return *reinterpret_cast<Lanes*>(plane.data() + at);
}

inline void draw_lanes(const Splat& s, float dx, float dy, std::size_t at, Tile& tile) {
  const IntLanes texel = texels_at(s, dx, dy);
  const Lanes nx = byte_of(texel, 8), ny = byte_of(texel, 16), nz = byte_of(texel, 24);
  const Lanes in_front = clamped_to((lanes_of(tile.depth, at) - s.depth) * s.inverse_reach + 0.5f, 0, 1);
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

// Draws eight pixels in a row of a streak.
inline void draw_lanes(const StreakSplat& s, float dx, float dy, std::size_t at, Tile& tile) {
  const Lanes x = dx + Lanes{0, 1, 2, 3, 4, 5, 6, 7};
  const Lanes along = x * s.along_x + dy * s.along_y,
              across = (x * s.along_y - dy * s.along_x) * s.inverse_radius;
  const Lanes past = (along - clamped_to(along, -s.half_length, s.half_length)) * s.inverse_radius;
  const Lanes from_axis = square_root(past * past + across * across);
  const Lanes rim = clamped_to((from_axis - (1 - s.softness)) * (1 / s.softness), 0, 1);
  const Lanes in_front = clamped_to(
      (lanes_of(tile.depth, at) - (s.depth + s.depth_slope * along)) * s.inverse_reach + 0.5f, 0, 1);
  const Lanes head = along / (s.half_length + 1 / s.inverse_radius);
  const Lanes tail = 1 - s.taper * (0.5f - 0.5f * clamped_to(head, -1, 1));
  Lanes& through = lanes_of(tile.through, at);
  const Lanes seen = through * (s.opacity * tail * in_front * (1 - rim * rim * (3 - 2 * rim)));
  // Fresnel's reflection by Schlick's approximation.
  const Lanes side = clamped_to(across, -1, 1);
  const Lanes m = 1 - square_root(1 - side * side), m2 = m * m;
  const StreakLight& light = *s.light;
  const Lanes mirrored = 0.02f + 0.98f * (m2 * m2 * m);
  const auto add_light = [&](std::array<float, kTilePixels>& plane, std::size_t c) {
    lanes_of(plane, at) +=
        seen * (light.middle[c] + mirrored * (light.rim[c] + light.rim_slope[c] * side - light.middle[c]));
  };
  add_light(tile.red, 0);
  add_light(tile.green, 1);
  add_light(tile.blue, 2);
  through -= seen * s.cover;
}

// Returns the part of a row that a splat covers, as left and right ends relative to the centre. The row is
// `dy` above the centre.
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

// Returns the splat with its factors scaled for texels in bytes: cover is byte / 255, a normal is byte /
// 127.5 - 1.
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

/// Draws into a tile whose depths are set; `farthest` is the greatest depth.
template <class S>
void draw_tile(std::span<const S> splats, std::span<const uint32_t> order, int tile_x, int tile_y,
               float farthest, Tile& tile) {
  tile.through.fill(1);
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
}

template <class S>
void sort_by_tiles(std::span<const S> splats, int width_px, int height_px, SplatTiles& tiles) {
  const int nx = tiles.columns = (width_px + kTileWidth_px - 1) / kTileWidth_px;
  const int ny = tiles.rows = (height_px + kTileHeight_px - 1) / kTileHeight_px;
  tiles.begins.assign(static_cast<std::size_t>(nx * ny) + 1, 0);
  TileRange touched{nx, ny, 0, 0};
  for (const S& s : splats) {
    const TileRange r = tiles_of(s, nx, ny);
    for (int y = r.y0; y < r.y1; ++y)
      for (int x = r.x0; x < r.x1; ++x) ++tiles.begins[static_cast<std::size_t>(y * nx + x) + 1];
    if (r.x0 < r.x1 && r.y0 < r.y1)
      touched = {std::min(touched.x0, r.x0), std::min(touched.y0, r.y0), std::max(touched.x1, r.x1),
                 std::max(touched.y1, r.y1)};
  }
  if (touched.x0 >= touched.x1) touched = {0, 0, 0, 0};
  tiles.x0 = touched.x0;
  tiles.y0 = touched.y0;
  tiles.x1 = touched.x1;
  tiles.y1 = touched.y1;
  for (std::size_t t = 1; t < tiles.begins.size(); ++t) tiles.begins[t] += tiles.begins[t - 1];
  tiles.order.resize(tiles.begins.back());
  std::vector<uint32_t> ends(tiles.begins.begin(), tiles.begins.end() - 1);
  for (uint32_t i = 0; i < splats.size(); ++i) {
    const TileRange r = tiles_of(splats[i], nx, ny);
    for (int y = r.y0; y < r.y1; ++y)
      for (int x = r.x0; x < r.x1; ++x) tiles.order[ends[static_cast<std::size_t>(y * nx + x)]++] = i;
  }
}

/// Calls f(i, at) for every pixel of a tile, with its index in the picture and its index in the tile.
template <class F>
void for_each_pixel(int x0, int y0, int width_px, int height_px, F&& f) {
  const int width = std::min(kTileWidth_px, width_px - x0), height = std::min(kTileHeight_px, height_px - y0);
  for (int y = 0; y < height; ++y) {
    const auto row =
        static_cast<std::size_t>(y0 + y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x0);
    for (int x = 0; x < width; ++x)
      f(row + static_cast<std::size_t>(x), static_cast<std::size_t>(y * kTileWidth_px + x));
  }
}

}  // namespace

std::span<const uint32_t> SplatTiles::of(int x, int y) const {
  const auto t = static_cast<std::size_t>(y * columns + x);
  return std::span(order).subspan(begins[t], begins[t + 1] - begins[t]);
}

void draw_splats(std::span<const Splat> front_to_back, SplatPicture& picture) {
  std::vector<Splat> splats(front_to_back.size());
  std::ranges::transform(front_to_back, splats.begin(), in_bytes);
  const auto pixels =
      static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px);
  picture.rgbt.resize(4 * pixels);
  SplatTiles tiles;
  sort_by_tiles(std::span<const Splat>(splats), picture.width_px, picture.height_px, tiles);
  const int columns = tiles.x1 - tiles.x0, rows = tiles.y1 - tiles.y0;
  tbb::parallel_for(0, columns * rows, [&](int k) {
    const int tile_x = tiles.x0 + k % columns, tile_y = tiles.y0 + k / columns;
    const int x = tile_x * kTileWidth_px, y = tile_y * kTileHeight_px;
    Tile tile;
    float farthest = 0;
    for_each_pixel(x, y, picture.width_px, picture.height_px, [&](std::size_t i, std::size_t at) {
      tile.depth[at] = picture.depth[i];
      farthest = std::max(farthest, picture.depth[i]);
    });
    draw_tile(std::span<const Splat>(splats), tiles.of(tile_x, tile_y), x, y, farthest, tile);
    for_each_pixel(x, y, picture.width_px, picture.height_px, [&](std::size_t i, std::size_t at) {
      float* out = picture.rgbt.data() + 4 * i;
      out[0] = tile.red[at];
      out[1] = tile.green[at];
      out[2] = tile.blue[at];
      out[3] = tile.through[at];
    });
  });
  picture.x0 = tiles.x0 * kTileWidth_px;
  picture.y0 = tiles.y0 * kTileHeight_px;
  picture.x1 = std::min(tiles.x1 * kTileWidth_px, picture.width_px);
  picture.y1 = std::min(tiles.y1 * kTileHeight_px, picture.height_px);
}

void StreakBands::sort(std::span<const StreakSplat> front_to_back, int width_px, int height_px) {
  static_assert(kRows % kTileHeight_px == 0);
  streaks_ = front_to_back;
  width_px_ = width_px;
  sort_by_tiles(streaks_, width_px, height_px, tiles_);
  ends_.assign(tiles_.begins.begin() + 1, tiles_.begins.end());
}

std::span<const uint32_t> StreakBands::rest_of(int tile_x, int tile_y, uint32_t first) const {
  const auto t = static_cast<std::size_t>(tile_y * tiles_.columns + tile_x);
  const std::span<const uint32_t> rest =
      std::span(tiles_.order).subspan(tiles_.begins[t], ends_[t] - tiles_.begins[t]);
  return rest.subspan(static_cast<std::size_t>(std::ranges::lower_bound(rest, first) - rest.begin()));
}

std::pair<int, int> StreakBands::columns_px(int left, int right) const {
  const int first = std::max(left / kTileWidth_px, tiles_.x0),
            last = std::min((right + kTileWidth_px - 1) / kTileWidth_px, tiles_.x1);
  return {first * kTileWidth_px, std::min(last * kTileWidth_px, width_px_)};
}

bool StreakBands::any(int bottom, int left, int right, uint32_t first) const {
  const int y0 = bottom / kTileHeight_px, y1 = (bottom + kRows) / kTileHeight_px;
  const auto [x0, x1] = columns_px(left, right);
  for (int y = std::max(y0, tiles_.y0); y < std::min(y1, tiles_.y1); ++y)
    for (int x = x0; x < x1; x += kTileWidth_px)
      if (!rest_of(x / kTileWidth_px, y, first).empty()) return true;
  return false;
}

void StreakBands::blend_over(const Strip& strip, const Eigen::Vector2f& distance, uint32_t first) {
  const auto [x0, x1] = columns_px(strip.left, strip.left + strip.width);
  const int columns = (x1 - x0 + kTileWidth_px - 1) / kTileWidth_px, first_column = x0 / kTileWidth_px;
  const int first_row = strip.bottom / kTileHeight_px,
            last_row =
                std::min((strip.bottom + strip.rows + kTileHeight_px - 1) / kTileHeight_px, tiles_.rows);
  tbb::parallel_for(0, columns * (last_row - first_row), [&](int k) {
    const int tile_x = first_column + k % columns, tile_y = first_row + k / columns;
    const std::span<const uint32_t> order = rest_of(tile_x, tile_y, first);
    if (order.empty()) return;
    ends_[static_cast<std::size_t>(tile_y * tiles_.columns + tile_x)] -= static_cast<uint32_t>(order.size());
    const int x = tile_x * kTileWidth_px - strip.left, y = tile_y * kTileHeight_px - strip.bottom;
    Tile tile;
    float farthest = 0;
    for_each_pixel(x, y, strip.width, strip.rows, [&](std::size_t i, std::size_t at) {
      tile.depth[at] = distance.x() / (strip.depth[i] + distance.y());
      farthest = std::max(farthest, tile.depth[at]);
    });
    draw_tile(streaks_, order, tile_x * kTileWidth_px, tile_y * kTileHeight_px, farthest, tile);
    for_each_pixel(x, y, strip.width, strip.rows, [&](std::size_t i, std::size_t at) {
      float* out = strip.rgba.data() + 4 * i;
      const float through = tile.through[at];
      out[0] = tile.red[at] + through * out[0];
      out[1] = tile.green[at] + through * out[1];
      out[2] = tile.blue[at] + through * out[2];
      out[3] = 1 - through * (1 - out[3]);
    });
  });
}

}  // namespace offstage::render
