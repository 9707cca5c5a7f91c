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

class ShadowMap {
 public:
  explicit ShadowMap(int size_px);
  int size_px() const { return size_px_; }
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
};

}  // namespace offstage::render
