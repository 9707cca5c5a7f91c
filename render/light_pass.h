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
  /// Of everything that was traced.
  const LightSums& sums() const { return sums_; }
  /// Binds and clears the targets for drawing surfaces.
  void begin() const;
  /// Reads the surfaces, traces their light, and binds it for the shaders.
  void trace(const LightSources& sources, const View& view, const SampleOffsets& offsets);
  /// After trace(): binds the targets for drawing the surfaces of glass in a part of the picture, and then
  /// traces their light. `depth`: the picture's, which hides glass behind opaque surfaces. The picture must
  /// show the opaque objects.
  void begin_glass(GLuint depth, const Eigen::AlignedBox2i& area_px);
  void trace_glass(const LightSources& sources, const View& view, const SampleOffsets& offsets,
                   GLuint picture_framebuffer);

 private:
  void read_surfaces(const Eigen::AlignedBox2i& area_px, SurfaceBuffer& surfaces) const;
  LightView light_view(const View& view, const SampleOffsets& offsets) const;

  RayScene scene_;
  Eigen::AlignedBox2i all_px_;
  LightSums sums_;
  SurfaceBuffer surfaces_;
  LightBuffer light_;
  gl::Texture places_, normals_;
  gl::Framebuffer framebuffer_;
  gl::Texture arriving_, mirrored_;
  bool mirrored_is_filled_ = true;  ///< with anything but zeros
  gl::Texture lamps_, highlights_;  ///< created when there are lamps

  // Created when there is glass.
  gl::Texture glass_depth_, through_glass_, mirrored_by_glass_;
  gl::Framebuffer glass_framebuffer_;
  Eigen::AlignedBox2i glass_px_;
  SurfaceBuffer glass_;
  GlassBuffer glass_light_;
  std::vector<Vector4f> picture_;
};

}  // namespace offstage::render
