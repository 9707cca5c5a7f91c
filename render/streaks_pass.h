#pragma once
/// Private: draws streaks: drops, sparks, trails. They are lit one by one, sorted together and splatted on
/// the CPU: those that are in front of all else over the finished picture as it is read back, others over the
/// part of it that something nearer is about to be drawn over.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/opacity_grid.h"
#include "render/paint_order.h"
#include "render/points_pass.h"
#include "render/puff_light.h"
#include "render/scene_shadow.h"
#include "render/splatter.h"

namespace offstage::render {

class StreaksPass {
 public:
  StreaksPass(int width_px, int height_px);
  /// Makes ready what a sub-frame shows. `light`: with the smoke between sun and streaks. Streaks stay where
  /// they are during a frame, so only its first sub-frame (`new_frame`) works out their light.
  void prepare(const PaintOrder& order, const View& view, const PuffLight& light, const ShadowMap& shadow_map,
               bool new_frame);
  /// From now on those from `first` of their keys in the PaintOrder on are behind what is drawn next.
  void pass(uint32_t first) { first_behind_ = first; }
  /// Lays those that are behind over an area of the picture, and returns the pixels that can have changed.
  Eigen::AlignedBox2i lay_behind(const Eigen::AlignedBox2i& area_px, const FrameUniforms& frame,
                                 GLuint color);
  /// Lays the rest over a band of the picture (see StreakBands). The picture's framebuffer is bound for
  /// reading, for both.
  void lay_over(int bottom, int rows, const FrameUniforms& frame, std::span<float> rgba);

 private:
  std::vector<StreakSplat> splats_;  ///< nearest first
  struct KnownLight {
    uint64_t id = ~uint64_t{0};
    StreakLight light;
  };
  std::vector<KnownLight> lights_;  ///< by number, of those seen in this frame
  SceneShadow shadow_;
  int width_px_, height_px_;
  uint32_t first_behind_ = 0;
  StreakBands bands_;
  std::vector<float> depth_, rgba_;  ///< of a band
};

}  // namespace offstage::render
