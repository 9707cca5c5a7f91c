// Implements filter_edges() of tone_map.h in integers, after T. Lottes, "FXAA" (NVIDIA, 2009). A pixel on an
// edge of high contrast is mixed with its neighbour across the edge, by a weight that depends on its distance
// from the end of the edge.

#include <algorithm>
#include <cstdlib>

#include <tbb/parallel_for.h>

#include "render/tone_map.h"

namespace offstage::render {
namespace {

constexpr int kSearch_px = 12;
constexpr int kMinContrast = 12;

// Brightness of a picture. The border pixels are repeated once outside, so that every pixel has neighbours.
struct Luma {
  int stride = 0;
  std::vector<uint8_t> values;

  explicit Luma(const Image& image)
      : stride(image.width_px + 2),
        values(static_cast<std::size_t>(stride) * static_cast<std::size_t>(image.height_px + 2)) {
    for (int y = -1; y <= image.height_px; ++y) {
      const int row = std::clamp(y, 0, image.height_px - 1);
      const uint8_t* in = image.rgba.data() + static_cast<std::ptrdiff_t>(row) * image.width_px * 4;
      uint8_t* out = values.data() + static_cast<std::ptrdiff_t>(y + 1) * stride + 1;
      for (int x = 0; x < image.width_px; ++x) {
        out[x] = static_cast<uint8_t>((in[4 * x] + 2 * in[4 * x + 1] + in[4 * x + 2]) / 4);
      }
      out[-1] = out[0];
      out[image.width_px] = out[image.width_px - 1];
    }
  }
  const uint8_t* row(int y) const { return values.data() + static_cast<std::ptrdiff_t>(y + 1) * stride + 1; }
};

// Marks the pixels of a row that differ enough from their neighbours. The loop is simple, so that the
// compiler vectorizes it.
void mark_edges(const Luma& luma, int y, int width, std::vector<uint8_t>& mark) {
  const uint8_t *north = luma.row(y - 1), *here = luma.row(y), *south = luma.row(y + 1);
  for (int x = 0; x < width; ++x) {
    const uint8_t high = std::max({north[x], south[x], here[x], here[x - 1], here[x + 1]});
    const uint8_t low = std::min({north[x], south[x], here[x], here[x - 1], here[x + 1]});
    const auto contrast = static_cast<uint8_t>(high - low);
    mark[static_cast<std::size_t>(x)] = contrast >= kMinContrast && contrast >= high / 8;
  }
}

// The mixture of a pixel with its neighbour at (dx, dy). `weight`: fraction of the neighbour in 1/256.
struct Mix {
  int dx = 0, dy = 0, weight = 0;
};

Mix mix_of(const Luma& luma, const Image& image, int x, int y) {
  const uint8_t* m = luma.row(y) + x;
  const int s = luma.stride;
  const int across_rows = std::abs(m[-s] + m[s] - 2 * m[0]) * 2 + std::abs(m[-s - 1] + m[s - 1] - 2 * m[-1]) +
                          std::abs(m[-s + 1] + m[s + 1] - 2 * m[1]);
  const int across_columns = std::abs(m[-1] + m[1] - 2 * m[0]) * 2 +
                             std::abs(m[-s - 1] + m[-s + 1] - 2 * m[-s]) +
                             std::abs(m[s - 1] + m[s + 1] - 2 * m[s]);
  const bool horizontal = across_rows >= across_columns;  // the edge is along x
  const int along = horizontal ? 1 : s;
  int across = horizontal ? s : 1;
  if (std::abs(m[-across] - m[0]) > std::abs(m[across] - m[0])) across = -across;
  const int gradient = std::abs(m[across] - m[0]);

  // Twice the brightness on the edge itself. The edge ends where this value changes by half the gradient.
  const int edge = m[0] + m[across];
  const auto search = [&](int step, int limit) {
    int n = 1;
    for (; n < limit; ++n) {
      const int value = m[n * step] + m[n * step + across] - edge;
      if (2 * std::abs(value) >= gradient) break;
    }
    return n;
  };
  const int room_back = horizontal ? x + 1 : y + 1;
  const int room_ahead = horizontal ? image.width_px - x : image.height_px - y;
  const int back = search(-along, std::min(kSearch_px, room_back));
  const int ahead = search(along, std::min(kSearch_px, room_ahead));
  const int near = std::min(back, ahead);
  const int end = near == back ? -along * back : along * ahead;
  // At its nearer end, the edge steps to one side. Only the pixels on this side are mixed.
  const int end_value = m[end] + m[end + across] - edge;
  const bool steps_here = (end_value < 0) != (2 * m[0] - edge < 0);
  int weight = steps_here ? 128 - 256 * near / (back + ahead) : 0;

  // A pixel that differs from all its neighbours is also mixed slightly.
  const int around = 2 * (m[-1] + m[1] + m[-s] + m[s]) + m[-s - 1] + m[-s + 1] + m[s - 1] + m[s + 1];
  const int range = std::max({m[-1], m[1], m[-s], m[s], m[0]}) - std::min({m[-1], m[1], m[-s], m[s], m[0]});
  const int stands_out = std::min(256, std::abs(around / 12 - m[0]) * 256 / range);
  weight = std::max(weight, stands_out * stands_out / 512);

  const int sign = across > 0 ? 1 : -1;
  return horizontal ? Mix{0, sign, weight} : Mix{sign, 0, weight};
}

}  // namespace

void filter_edges(Image& image) {
  if (image.rgba.empty()) return;
  const Luma luma(image);
  const std::vector<uint8_t> source = image.rgba;
  tbb::parallel_for(0, image.height_px, [&](int y) {
    std::vector<uint8_t> mark(static_cast<std::size_t>(image.width_px));
    mark_edges(luma, y, image.width_px, mark);
    for (int x = 0; x < image.width_px; ++x) {
      if (!mark[static_cast<std::size_t>(x)]) continue;
      const Mix mix = mix_of(luma, image, x, y);
      const int nx = std::clamp(x + mix.dx, 0, image.width_px - 1),
                ny = std::clamp(y + mix.dy, 0, image.height_px - 1);
      const std::size_t here = 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                                    static_cast<std::size_t>(x));
      const std::size_t there = 4 * (static_cast<std::size_t>(ny) * static_cast<std::size_t>(image.width_px) +
                                     static_cast<std::size_t>(nx));
      for (std::size_t c = 0; c < 4; ++c) {
        const int value = source[here + c] * (256 - mix.weight) + source[there + c] * mix.weight;
        image.rgba[here + c] = static_cast<uint8_t>((value + 128) / 256);
      }
    }
  });
}

}  // namespace offstage::render
