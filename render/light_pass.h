#pragma once
/// Private: computes the light of the visible surfaces in a sub-frame. Positions and normals of the surfaces
/// are drawn into textures and read back. Their light is traced on the CPU (render/trace), and the shaders
/// read it from textures (shaders/traced.glsl). This is done first for all opaque objects, then for all
/// glass, and then for each layer of the other translucent bodies.

#include <array>
#include <optional>

#include "render/gl.h"
#include "render/trace/light_tracer.h"

namespace offstage::render {

struct View;

class LightPass {
 public:
  /// Creates the textures. `depth`: depth buffer of the picture, into which the visible surfaces are drawn.
  /// `quick`: see StageDef.
  LightPass(int width_px, int height_px, const gl::Texture& depth, bool quick);
  /// Returns the scene for ray tracing. It must be filled and built before trace().
  RayScene& scene() { return scene_; }
  const RayScene& scene() const { return scene_; }
  /// Returns the sums over all traced light.
  const LightSums& sums() const { return sums_; }
  /// Binds and clears the targets for drawing surfaces.
  void begin() const;
  /// Reads the surfaces, traces their light, and binds it for the shaders. `stop`: see Stage::draw.
  void trace(const LightSources& sources, const View& view, const SampleOffsets& offsets,
             const StopTest& stop);
  /// Binds the surfaces for shaders/plain.frag. Must be called after trace() of a quick picture.
  void bind_surfaces() const;
  /// Binds the targets for drawing the nearest surfaces of glass, or of a translucent body, in a part of the
  /// picture. Must be called after trace(). `depth`: depth buffer, whose nearer surfaces hide the new ones.
  /// Returns false if the area is outside of the picture.
  bool begin_part(GLuint depth, const Eigen::AlignedBox2i& area_px);
  /// As begin_part(), but for the farthest surfaces of a translucent body that are in front of `behind`, a
  /// depth buffer. It is bound for the shaders of the surfaces (LAYER in shaders/surface.glsl).
  bool begin_layer(GLuint behind, const Eigen::AlignedBox2i& area_px);
  /// Traces the light of glass. `picture_framebuffer` must contain the opaque objects.
  void trace_glass(const LightSources& sources, const View& view, const SampleOffsets& offsets,
                   GLuint picture_framebuffer);
  /// Traces the light of the drawn surfaces of a translucent body. It replaces the light of the opaque
  /// objects in the textures, so these must be drawn before. Returns the depth buffer of the surfaces, which
  /// stays unchanged during the next layer, or 0 if there are none.
  GLuint trace_body(const LightSources& sources, const View& view, const SampleOffsets& offsets);

 private:
  bool begin_part(const Eigen::AlignedBox2i& area_px);
  void read_surfaces(const Eigen::AlignedBox2i& area_px, SurfaceBuffer& surfaces) const;
  bool crop_to_surfaces();
  LightView light_view(const View& view, const SampleOffsets& offsets) const;
  void make_textures(std::initializer_list<gl::Texture*> textures) const;
  void write_light(const Eigen::AlignedBox2i& area_px, const LightBuffer& light);
  void write_lamps(const Eigen::AlignedBox2i& area_px, const std::vector<Vector4f>& lamps,
                   const std::vector<Vector4f>& highlights);

  RayScene scene_;
  Eigen::AlignedBox2i all_px_;
  LightSums sums_;
  /// The surfaces whose light was traced last: all opaque surfaces, or a translucent part.
  SurfaceBuffer surfaces_;
  LightBuffer light_;
  bool quick_;
  gl::Texture places_, normals_;
  gl::Texture colors_;  ///< colours of surfaces; only for quick pictures
  gl::Framebuffer framebuffer_;
  gl::Texture arriving_, mirrored_;
  bool mirrored_is_filled_ = true;  ///< whether any value of the texture of mirrored light is not zero
  gl::Texture lamps_, highlights_;  ///< created when there are lamps
  gl::Texture sun_;                 ///< created when panes tint the light of the sun

  // Created when there is a translucent object.
  std::array<gl::Texture, 2> part_depths_;  ///< of the last two parts
  std::size_t part_ = 0;                    ///< index of the current part's depth
  gl::Framebuffer part_framebuffer_;
  Eigen::AlignedBox2i part_px_;
  std::optional<LightBuffer> body_light_;
  gl::Texture through_glass_, mirrored_by_glass_;
  GlassBuffer glass_light_;
  std::vector<Vector4f> picture_;
};

}  // namespace offstage::render
