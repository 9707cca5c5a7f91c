#pragma once
/// Private: how much of the sky near things hide from each place in the picture, found on the screen from the
/// depth of what is opaque, in a picture of half the size. Each sub-frame looks at a few places; their mean
/// is smooth.

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

class OcclusionPass {
 public:
  OcclusionPass(int width_px, int height_px);
  /// Reads the texture `depth` and leaves the result bound for shading. `reach`: how far away things are
  /// looked for [m]; 0: all is open, as it is outside of `area`. `count`: of sub-frames, `seed` of this one.
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
