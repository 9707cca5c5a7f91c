#pragma once
/// Private: draws many soft particles over each other on the CPU, front to back, by tiles in parallel. Where
/// those in front cover a tile, those behind are not touched. llvmpipe needs several times as long for the
/// same, since every quad goes through its vertex shader and set-up on one thread.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "render/puff_atlas.h"

namespace offstage::render {

/// One puff on the screen, in pixels of the picture it is drawn in, y upwards: an affine picture of an
/// atlas's cell, lit by its normals. It fades where the scene cuts through it.
struct Splat {
  float x, y;            ///< of the centre
  float half_x, half_y;  ///< half-size of the rectangle around it
  float ux, uy, vx,
      vy;  ///< place in the atlas's cell, in [-1, 1]: u = ux * dx + uy * dy, v = vx * dx + vy * dy
  float depth, inverse_reach;  ///< along the view axis [m]; 1 / (2 * radius)
  float opacity;               ///< where the cell covers all
  float cover;                 ///< of its opacity that hides what is behind: 1 smoke, 0 only adds light
  /// Radiance of red, green, blue where the normal is n: r[0] + r[1] n.x + r[2] n.y + r[3] n.z
  float radiance[3][4];
  PuffAtlas::Level cell;
};

/// What a streak sends to the eye: radiance in the middle, and mirrored at the sides, by the place across.
struct StreakLight {
  float middle[3], rim[3], rim_slope[3];
};

/// One streak on the screen: the stroke of a soft round pen.
struct StreakSplat {
  float x, y;
  float half_x, half_y;
  float along_x, along_y;             ///< unit vector to its head
  float half_length, inverse_radius;  ///< of the straight part; 1 / radius
  float depth, depth_slope;           ///< at the centre [m], and its change per pixel towards the head
  float inverse_reach;                ///< 1 / (2 * radius) [1/m]
  float opacity, cover;               ///< as of a Splat
  float softness, taper;              ///< as in PointsDef
  const StreakLight* light;
};

/// What splats are drawn in. Premultiplied colour, and the share of what is behind that still shows.
struct SplatPicture {
  int width_px = 0, height_px = 0;
  std::vector<float> depth;  ///< of the scene along the view axis [m], one a pixel
  std::vector<float> rgbt;   ///< 4 a pixel; written where a splat may be

  /// Rectangle of pixels that may have changed, whole tiles; the rest of rgbt is not touched.
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Which splats touch each tile of a picture, in their order.
struct SplatTiles {
  int columns = 0, rows = 0;
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< rectangle of tiles that any touches
  std::vector<uint32_t> begins;        ///< of each tile's splats in `order`, by rows; then the end
  std::vector<uint32_t> order;

  bool empty() const { return x0 >= x1; }
  std::span<const uint32_t> of(int x, int y) const;
};

/// `front_to_back`: the order matters. The result does not depend on the number of threads.
void draw_splats(std::span<const Splat> front_to_back, SplatPicture& picture);

/// Streaks over a picture that is there by bands alone, as it is read back: it needs no other of its size.
/// Each tile draws its streaks back to front in as many goes as other things come in between.
class StreakBands {
 public:
  static constexpr int kRows = 32;  ///< of a band [px]
  /// A part of a band. `bottom` is a multiple of kRows, `left` and the right end are those of tiles.
  struct Strip {
    int left, bottom, width, rows;
    std::span<const float> depth;  ///< one a pixel, of the depth buffer
    std::span<float> rgba;         ///< premultiplied
  };

  /// Finds what each tile has to draw. The streaks must stay where they are.
  void sort(std::span<const StreakSplat> front_to_back, int width_px, int height_px);
  /// The columns of tiles that have a streak and a pixel from `left` to `right`.
  std::pair<int, int> columns_px(int left, int right) const;
  /// Whether those tiles of a band have streaks, from number `first` on, that were not drawn.
  bool any(int bottom, int left, int right, uint32_t first) const;
  /// Lays the streaks from `first` on that were not drawn yet over a strip. The distance along the view axis
  /// is x / (depth + y) of `distance`.
  void lay_over(const Strip& strip, const Eigen::Vector2f& distance, uint32_t first);

 private:
  std::span<const uint32_t> rest_of(int tile_x, int tile_y, uint32_t first) const;

  std::span<const StreakSplat> streaks_;
  int width_px_ = 0;
  SplatTiles tiles_;
  std::vector<uint32_t>
      ends_;  ///< of each tile, in the tiles' order: behind those that are still to be drawn
};

}  // namespace offstage::render
