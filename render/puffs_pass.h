#pragma once
/// Private: draws smoke and fire. The puffs of all sets are lit once per puff, sorted together and splatted
/// on the CPU, at reduced resolution where they are large. The result is composited over the scene with
/// regard to its depth. This needs several runs if other translucent objects are between puffs. A grid stores
/// the attenuation of sunlight in smoke, which also casts shadows on the scene.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/opacity_grid.h"
#include "render/paint_order.h"
#include "render/points_pass.h"
#include "render/puff_atlas.h"
#include "render/puff_light.h"
#include "render/splatter.h"

namespace offstage::render {

/// Flames contain soot, so that the brightness of deep flames has a limit: opacity of flames against the
/// background, as a fraction.
inline constexpr float kFlameCover = 0.6f;
/// Returns the mean radiance of a flame, per channel, as a factor of its colour. `number`: the pseudo-random
/// number of its point.
Vector3f mean_radiance_of_flame(float number);

class PuffsPass {
 public:
  PuffsPass(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}
  /// Computes the attenuation of sunlight by the smoke and drops of these sets.
  void prepare(std::span<const PointSet* const> sets, const Sun& sun);
  const OpacityGrid& grid() const { return grid_; }
  /// Returns the mean opacity of opaque puffs over their discs. `style`: smoke or fire. Must be called after
  /// prepare().
  float mean_cover(PointStyle style) const;
  /// Lights the puffs of a sub-frame. The order must stay in memory until they are drawn.
  void prepare_splats(const PaintOrder& order, const View& view, const PuffLight& light);
  /// Returns the pixels that puffs `first` to `last` (keys in the PaintOrder) can change.
  Eigen::AlignedBox2i area_px(uint32_t first, uint32_t last) const;
  /// Draws these puffs over the picture in `framebuffer`. The depth of the picture must also be bound to the
  /// texture unit `kSceneDepthUnit`.
  void draw(uint32_t first, uint32_t last, const FrameUniforms& frame, GLuint framebuffer);

 private:
  void measure(const PaintOrder& order, const View& view, float pixel_m);
  void make_splats(const PaintOrder& order, const View& view, const PuffLight& light);
  void read_depth(std::span<const Splat> splats, const FrameUniforms& frame, GLuint framebuffer);
  void composite(GLuint framebuffer);

  int width_px_, height_px_;
  std::unique_ptr<const PuffAtlas> atlas_;  ///< created on first use
  OpacityGrid grid_;

  float typical_m_ = 0;   ///< typical radius of a puff
  float farthest_m_ = 0;  ///< depth of the farthest puff
  int factor_ =
      1;  ///< factor by which the resolution of the puffs is reduced; depends on their number and size
  std::vector<Splat> splats_;  ///< nearest first
  std::vector<float> depths_;
  SplatPicture picture_;
  gl::Texture colors_, low_depths_;
  int texture_factor_ = 0;
  gl::LazyProgram program_{{"frame.glsl", "sky.vert"}, {"frame.glsl", "puffs.frag"}};
  gl::VertexArray no_attributes_ = gl::make_vertex_array();
};

}  // namespace offstage::render
