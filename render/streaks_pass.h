#pragma once
/// Private: draws streaks: drops, sparks, trails. They are lit one by one, sorted together and splatted on
/// the CPU. Streaks in front of all other objects are drawn over the finished picture while it is read back;
/// others are drawn over an area of the picture before a nearer object is drawn there.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/opacity_grid.h"
#include "render/paint_order.h"
#include "render/points_pass.h"
#include "render/puff_light.h"
#include "render/splatter.h"

namespace offstage::render {

class StreaksPass {
 public:
  StreaksPass(int width_px, int height_px);
  /// Prepares the streaks of a sub-frame. `light` includes the smoke between sun and streaks. Streaks do not
  /// move during a frame, so only its first sub-frame (`new_frame`) computes their light.
  void prepare(const PaintOrder& order, const View& view, const PuffLight& light, bool new_frame);
  /// Sets the first streak that is behind the next object, as an index into its keys in the PaintOrder. All
  /// later streaks are also behind the object.
  void pass(uint32_t first) { first_behind_ = first; }
  /// Draws the streaks behind the next object over an area of the picture; returns the pixels that may have
  /// changed.
  Eigen::AlignedBox2i draw_behind(const Eigen::AlignedBox2i& area_px, const FrameUniforms& frame,
                                  GLuint color);
  /// Draws the remaining streaks over a band of the picture (see StreakBands). For both functions, the
  /// picture's framebuffer must be bound for reading.
  void blend_over(int bottom, int rows, const FrameUniforms& frame, std::span<float> rgba);

 private:
  std::vector<StreakSplat> splats_;  ///< nearest first
  struct KnownLight {
    uint64_t id = ~uint64_t{0};
    StreakLight light;
  };
  std::vector<KnownLight> lights_;  ///< light of the streaks that are visible in this frame, by their numbers
  int width_px_, height_px_;
  uint32_t first_behind_ = 0;
  StreakBands bands_;
  std::vector<float> depth_, rgba_;  ///< depth and colour of a band of the picture
};

}  // namespace offstage::render
