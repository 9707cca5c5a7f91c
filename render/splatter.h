#pragma once
/// Private: draws many overlapping soft particles on the CPU, front to back, with tiles in parallel.
/// Particles behind an opaque tile are skipped. llvmpipe would take several times as long, because it runs
/// the vertex shader and the set-up of all quads on one thread.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "render/puff_atlas.h"

namespace offstage::render {

/// One puff on the screen, in pixels of the target picture, y upwards: a cell of the atlas under an affine
/// transformation, lit by its normals. It fades out where it intersects the scene.
struct Splat {
  float x, y;            ///< centre
  float half_x, half_y;  ///< half-size of the rectangle around it
  float ux, uy, vx,
      vy;  ///< Position in the atlas's cell, in [-1, 1]: u = ux * dx + uy * dy, v = vx * dx + vy * dy.
  float depth, inverse_reach;  ///< distance along the view axis [m]; 1 / (2 * radius) [1/m]
  float opacity;               ///< opacity where the cell's cover is 1
  float cover;  ///< fraction of the opacity that hides the background: 1 for smoke; with 0, the splat only
                ///< adds light
  /// Radiance of red, green and blue where the normal is n: r[0] + r[1] n.x + r[2] n.y + r[3] n.z.
  float radiance[3][4];
  PuffAtlas::Level cell;
};

/// Light of a streak towards the eye: radiance in the middle, and mirrored light at the sides, as functions
/// of the position across.
struct StreakLight {
  float middle[3], rim[3], rim_slope[3];
};

/// One streak on the screen: a line with soft, round ends.
struct StreakSplat {
  float x, y;
  float half_x, half_y;
  float along_x, along_y;             ///< unit vector towards the head of the streak
  float half_length, inverse_radius;  ///< half-length of the straight part; 1 / radius
  /// Distance of the centre along the view axis [m], and its change per pixel towards the head.
  float depth, depth_slope;
  float inverse_reach;    ///< 1 / (2 * radius) [1/m]
  float opacity, cover;   ///< see Splat::opacity and Splat::cover
  float softness, taper;  ///< see PointsDef::softness and PointsDef::taper
  const StreakLight* light;
};

/// Target picture of splats: premultiplied colour, and the visible fraction of the background.
struct SplatPicture {
  int width_px = 0, height_px = 0;
  std::vector<float> depth;  ///< depth of the scene along the view axis [m], one value per pixel
  std::vector<float> rgbt;   ///< 4 values per pixel; valid only in the tiles that splats touch

  /// Rectangle of pixels that may have changed, in whole tiles; the rest of rgbt is not written.
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// The splats that touch each tile of a picture, in their order.
struct SplatTiles {
  int columns = 0, rows = 0;
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< rectangle of tiles that are touched
  std::vector<uint32_t> begins;        ///< first splat of each tile in `order`, by rows; then the end
  std::vector<uint32_t> order;

  bool empty() const { return x0 >= x1; }
  std::span<const uint32_t> of(int x, int y) const;
};

/// Draws splats in the order front to back. The result does not depend on the number of threads.
void draw_splats(std::span<const Splat> front_to_back, SplatPicture& picture);

/// Draws streaks over a picture that exists only band by band while it is read back, so no second picture of
/// its size is needed. Each tile draws its streaks back to front, in several parts if other objects are
/// between them.
class StreakBands {
 public:
  static constexpr int kRows = 32;  ///< rows of a band [px]
  /// A part of a band. `bottom` is a multiple of kRows; left and right ends are at tile borders.
  struct Strip {
    int left, bottom, width, rows;
    std::span<const float> depth;  ///< values of the depth buffer, one per pixel
    std::span<float> rgba;         ///< premultiplied
  };

  /// Finds the streaks of each tile. The streaks must stay in memory.
  void sort(std::span<const StreakSplat> front_to_back, int width_px, int height_px);
  /// Returns the range of tile columns between `left` and `right` that contain streaks.
  std::pair<int, int> columns_px(int left, int right) const;
  /// Returns whether the tiles of a band from `left` to `right` contain streaks, from number `first` on, that
  /// were not drawn yet.
  bool any(int bottom, int left, int right, uint32_t first) const;
  /// Draws the streaks from number `first` on that were not drawn yet over a strip. `distance` converts
  /// values of the depth buffer: the distance along the view axis is distance.x / (depth + distance.y) [m].
  void blend_over(const Strip& strip, const Eigen::Vector2f& distance, uint32_t first);

 private:
  std::span<const uint32_t> rest_of(int tile_x, int tile_y, uint32_t first) const;

  std::span<const StreakSplat> streaks_;
  int width_px_ = 0;
  SplatTiles tiles_;
  /// For each tile, in the order of the tiles: end of the streaks that are still to be drawn.
  std::vector<uint32_t> ends_;
};

}  // namespace offstage::render
