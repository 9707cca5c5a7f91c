#pragma once
/// Private: draws streaks: drops, sparks, trails. They are lit one by one, sorted together and splatted on
/// the CPU, over the finished picture as it is read back.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/opacity_grid.h"
#include "render/points_pass.h"
#include "render/puff_light.h"
#include "render/scene_shadow.h"
#include "render/splatter.h"

namespace offstage::render {

class StreaksPass {
 public:
  StreaksPass(int width_px, int height_px);
  /// Forgets those of the sub-frame before.
  void clear() { any_ = false; }
  /// Makes ready what a sub-frame shows. `light`: with the smoke between sun and streaks. Streaks stay where
  /// they are during a frame, so only its first sub-frame (`new_frame`) works out their light.
  void prepare(std::span<const PointSet* const> sets, const View& view, const PuffLight& light,
               const ShadowMap& shadow_map, bool new_frame);
  /// Lays them over a band of the picture in the framebuffer that is bound for reading (see StreakBands).
  void lay_over(int bottom, int rows, const FrameUniforms& frame, std::span<float> rgba);

 private:
  void sort_visible(std::span<const PointSet* const> sets, const View& view);

  struct Source {
    const PointSet* set;
    uint32_t first;  ///< number of its first point among those of all sets
  };
  std::vector<Source> sources_;
  std::vector<uint64_t> keys_;  ///< depth and number of a point, nearest first
  std::vector<StreakSplat> splats_;
  struct KnownLight {
    uint64_t id = ~uint64_t{0};
    StreakLight light;
  };
  std::vector<KnownLight> lights_;  ///< by number, of those seen in this frame
  SceneShadow shadow_;
  int width_px_, height_px_;
  bool any_ = false;
  StreakBands bands_;
  std::vector<float> depth_;  ///< of a band
};

}  // namespace offstage::render
