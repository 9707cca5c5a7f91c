#pragma once
/// Private: the sun's shadow map. Its orthographic frame covers only the part of the view that can be in
/// shadow, so no texels are spent on the far horizon. The frame is aligned to whole texels and its size
/// changes in steps, so that shadows do not swim when the camera or objects move.

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

/// A ball that bounds a shadow caster.
struct Caster {
  Vector3f center;
  float radius;
};

struct ShadowFrame {
  Matrix4f clip_from_world;
  float texel_m = 0;  ///< 0: nothing in view can be in shadow
  float depth_m = 0;  ///< range along the light that maps to 0 to 1
};

/// Largest distance from a point in which its shadow is searched [texels].
inline constexpr float kWidestPenumbra_px = 24;

/// Fits the frame to the view. `pixel_m`: width of a pixel of the picture at distance 1.
ShadowFrame fit_shadow(std::span<const Caster> casters, const View& view, const Vector3f& sun_direction,
                       float pixel_m, int size_px);

/// Largest distance beside a caster at which its shadow is still found, across the light: the reach of the
/// search, the four texels of one lookup, and the offset of a point from its surface.
inline float search_m(const ShadowFrame& frame) {
  return (kWidestPenumbra_px + 6) * frame.texel_m;
}

class ShadowMap {
 public:
  explicit ShadowMap(int size_px);
  int size_px() const { return size_px_; }
  /// Stores where casters are, so that shading searches the map only where one may be in front. Other points
  /// cost a single lookup.
  void mark(const ShadowFrame& frame, std::span<const Caster> balls,
            std::span<const Eigen::AlignedBox3f> boxes);
  /// Binds and clears the map and sets the state for drawing casters into it.
  void begin() const;
  /// Ends drawing and leaves the map bound for shading.
  void end() const;
  /// Reads the depths of a rectangle of texels, row by row, for lighting on the CPU; 65535 stands for 1.
  void read(int x, int y, int width, int height, std::vector<uint16_t>& depths) const;

 private:
  int size_px_;
  gl::Texture depth_;
  gl::Framebuffer framebuffer_;
  gl::Sampler plain_;
  std::vector<float>
      nearest_;  ///< smallest depth of the casters around each cell of a coarse grid over the map
  gl::Texture nearest_texture_;
};

}  // namespace offstage::render
