#pragma once
/// Private: computes how much of the sky nearby objects hide from each pixel (ambient occlusion). It works in
/// screen space on the depth of the opaque objects, at half resolution. Each sub-frame takes a few samples;
/// the mean over the sub-frames is smooth.

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

class OcclusionPass {
 public:
  OcclusionPass(int width_px, int height_px);
  /// Reads the texture `depth` and leaves the result bound for shading. `reach`: largest distance of
  /// occluders [m]; 0 disables occlusion. Pixels outside `area` count as unoccluded. `count`: number of
  /// sub-frames; `seed`: number of this one.
  void draw(GLuint depth, const View& view, float reach, const ScreenArea& area, int count, float seed);

 private:
  int width_px_, height_px_;
  Vector2f picture_size_;
  gl::Texture open_, smooth_;
  gl::Framebuffer open_framebuffer_, smooth_framebuffer_;
  gl::LazyProgram program_{{"frame.glsl", "occlusion.vert"}, {"frame.glsl", "occlusion.frag"}};
  gl::LazyProgram blur_{{"frame.glsl", "sky.vert"}, {"frame.glsl", "occlusion_blur.frag"}};
  gl::VertexArray no_attributes_ = gl::make_vertex_array();
};

}  // namespace offstage::render
