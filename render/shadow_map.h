#pragma once
/// Private: the sun's shadow map. Its orthographic frame covers the part of the view in which a caster can
/// shadow anything, so no texel is spent on the far horizon; it sits on a grid of whole texels and its size
/// goes in steps, so that shadows do not swim when the camera or things move.

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

/// A ball that bounds something that casts a shadow.
struct Caster {
  Vector3f center;
  float radius;
};

struct ShadowFrame {
  Matrix4f clip_from_world;
  float texel_m = 0;  ///< 0: nothing in view can be in a shadow
  float depth_m = 0;  ///< along the light, from 0 to 1 in the map
};

/// The furthest from a place that its shadow is searched for [texels].
inline constexpr float kWidestPenumbra_px = 24;

/// `pixel_m`: width of a pixel of the picture at distance 1.
ShadowFrame fit_shadow(std::span<const Caster> casters, const View& view, const Vector3f& sun_direction,
                       float pixel_m, int size_px);

/// How far beside a caster something of its shadow is found, across the light: the search's reach, its four
/// texels at once, and what a place is moved off its surface.
inline float search_m(const ShadowFrame& frame) {
  return (kWidestPenumbra_px + 6) * frame.texel_m;
}

class ShadowMap {
 public:
  explicit ShadowMap(int size_px);
  int size_px() const { return size_px_; }
  /// Says where casters are, so that shading only searches the map where one may be in front: the rest of the
  /// ground is lit at the cost of one look.
  void mark(const ShadowFrame& frame, std::span<const Caster> balls,
            std::span<const Eigen::AlignedBox3f> boxes);
  /// Binds and clears the map and sets the state for drawing casters into it.
  void begin() const;
  /// Ends drawing and leaves the map bound for shading.
  void end() const;
  /// Depths of a rectangle of texels, row by row, for what is lit on the CPU; 65535 is 1.
  void read(int x, int y, int width, int height, std::vector<uint16_t>& depths) const;

 private:
  int size_px_;
  gl::Texture depth_;
  gl::Framebuffer framebuffer_;
  gl::Sampler plain_;
  std::vector<float> nearest_;  ///< depth of the casters around each cell of a coarse grid over the map
  gl::Texture nearest_texture_;
};

}  // namespace offstage::render
