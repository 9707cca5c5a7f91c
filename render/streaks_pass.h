#pragma once
/// Private: draws streaks: drops, sparks, trails. They are lit one by one, sorted together and splatted on
/// the CPU, in a picture of full size that is then laid over the scene.

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
  /// Draws over the picture in `framebuffer`. `light`: with the smoke between sun and streaks. Streaks stay
  /// where they are during a frame, so only its first sub-frame (`new_frame`) works out their light.
  void draw(std::span<const PointSet* const> sets, const View& view, const PuffLight& light,
            const ShadowMap& shadow_map, GLuint framebuffer, bool new_frame);

 private:
  void sort_visible(std::span<const PointSet* const> sets, const View& view);
  void read_depth(const FrameUniforms& frame, GLuint framebuffer);
  void composite(GLuint framebuffer);

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
  SplatPicture picture_;
  gl::Texture colors_;
  gl::LazyProgram program_{{"frame.glsl", "sky.vert"}, {"frame.glsl", "streaks.frag"}};
  gl::VertexArray no_attributes_ = gl::make_vertex_array();
};

}  // namespace offstage::render
