#pragma once
/// Private: draws smoke and fire. All puffs of all sets are lit once per puff, sorted together, and splatted
/// on the CPU, in a smaller picture where they are large; that is laid over the scene with an eye on its
/// depth, at once or, where other translucent things are between puffs, in several runs. What the sun loses
/// in the smoke is a grid, which also shadows the scene.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/opacity_grid.h"
#include "render/paint_order.h"
#include "render/points_pass.h"
#include "render/puff_atlas.h"
#include "render/puff_light.h"
#include "render/shadow_map.h"
#include "render/splatter.h"

namespace offstage::render {

class PuffsPass {
 public:
  PuffsPass(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}
  /// Finds what smoke and drops of these sets take from the sun and, if it shades the scene, sets the frame's
  /// field and binds the grid.
  void prepare(std::span<const PointSet* const> sets, const Sun& sun, FrameUniforms& frame);
  const OpacityGrid& grid() const { return grid_; }
  /// Whether the scene must look up the smoke's shadow.
  bool shades() const { return !grid_.empty(); }
  /// Lights the puffs of a sub-frame. The order must stay until they are drawn.
  void prepare_splats(const PaintOrder& order, const View& view, const PuffLight& light,
                      const ShadowMap& shadow_map);
  /// The pixels that the puffs from `first` to `last` of their keys in the PaintOrder can change.
  Eigen::AlignedBox2i area_px(uint32_t first, uint32_t last) const;
  /// Draws those over the picture in `framebuffer`, whose depth is also in the texture unit
  /// `kSceneDepthUnit`.
  void draw(uint32_t first, uint32_t last, const FrameUniforms& frame, GLuint framebuffer);

 private:
  void measure(const PaintOrder& order, const View& view, float pixel_m);
  void make_splats(const PaintOrder& order, const View& view, const PuffLight& light,
                   const ShadowMap& shadow_map);
  void read_depth(std::span<const Splat> splats, const FrameUniforms& frame, GLuint framebuffer);
  void composite(GLuint framebuffer);

  int width_px_, height_px_;
  std::unique_ptr<const PuffAtlas> atlas_;  ///< made when first needed
  OpacityGrid grid_;
  gl::Texture grid_texture_;
  std::array<int, 3> grid_size_{};

  float typical_m_ = 0;        ///< radius
  float farthest_m_ = 0;       ///< depth behind which no puff is
  int factor_ = 1;             ///< by which the picture of this many and large puffs can be smaller
  std::vector<Splat> splats_;  ///< nearest first
  std::vector<float> depths_;
  SplatPicture picture_;
  gl::Texture colors_, low_depths_;
  int texture_factor_ = 0;
  gl::LazyProgram program_{{"frame.glsl", "sky.vert"}, {"frame.glsl", "puffs.frag"}};
  gl::VertexArray no_attributes_ = gl::make_vertex_array();
};

}  // namespace offstage::render
