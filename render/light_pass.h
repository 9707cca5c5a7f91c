#pragma once
/// Private: the light of opaque surfaces in a sub-frame. The surfaces are drawn into targets and read back,
/// their light is traced (render/trace), and the shaders read it from textures (shaders/traced.glsl).

#include <span>

#include "render/gl.h"
#include "render/trace/light_tracer.h"

namespace offstage::render {

struct View;

class LightPass {
 public:
  /// `depth`: the picture's depth, in which the visible surfaces were drawn.
  LightPass(int width_px, int height_px, const gl::Texture& depth);
  /// The scene that rays meet, to be filled and built before trace().
  RayScene& scene() { return scene_; }
  /// Binds and clears the targets for drawing surfaces.
  void begin() const;
  /// Reads the surfaces, traces their light, and binds it for the shaders.
  void trace(const LightSources& sources, const View& view, const SampleOffsets& offsets);

 private:
  RayScene scene_;
  SurfaceBuffer surfaces_;
  LightBuffer light_;
  gl::Texture places_, normals_;
  gl::Framebuffer framebuffer_;
  gl::Texture arriving_, mirrored_;
  bool mirrored_is_filled_ = true;  ///< with anything but zeros
  gl::Texture lamps_, highlights_;  ///< created when there are lamps
};

}  // namespace offstage::render
