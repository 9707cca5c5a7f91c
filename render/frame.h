#pragma once
/// Private: the uniforms that all shaders of one sub-frame share. They are computed on the CPU from camera,
/// sun and sky.

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "render/stage.h"

namespace offstage::render {

using Eigen::Matrix4f;

/// The uniform block of shaders/frame.glsl, in std140 layout. Matrices come first because Eigen aligns them
/// more strictly.
struct FrameUniforms {
  Matrix4f clip_from_world;
  Vector4f eye;
  Vector4f sun_direction;
  Vector4f sun_radiance;
  Vector4f zenith, horizon, ground, glow;
  std::array<Vector4f, 7> irradiance;  ///< nine coefficients; the last two are in the first six w; the
                                       ///< last w: see sun_lobe() in light.glsl
  Vector4f ray_center, ray_x, ray_y;
  Vector4f depth;
  Vector4f air;

  Vector3f irradiance_at(std::size_t k) const;  ///< coefficient k of sky_irradiance(), in [0, 9)
};

static_assert(offsetof(FrameUniforms, air) == 22 * sizeof(Vector4f));

/// Preprocessor definitions that adapt shaders to the lighting, such as "LAMPS 1".
using Features = std::vector<std::string>;

/// The camera of one sub-frame. The eye is displaced within the lens and looks along `forward`.
struct View {
  Matrix4f clip_from_world;
  Vector3f eye, right, up, forward;
  Vector2f tan_half;  ///< half of the width and height of the image plane at a distance of 1 m
  Vector2f shear;     ///< shift of the image due to lens and pixel offsets, as a fraction of tan_half
  float near_m = 0, far_m = 0;

  /// Returns whether a ball may be visible: false only if it is outside of one plane of the frustum.
  bool sees(const Vector3f& center, float radius) const;
  float depth_of(const Vector3f& point) const { return forward.dot(point - eye); }
};

/// The bounding rectangle in the picture of a set of balls. All balls have the radius `margin` [m].
class ScreenArea {
 public:
  ScreenArea(const View& view, float margin) : view_(view), margin_(margin) {}
  void add(const Vector3f& place);
  /// Extends the rectangle to the whole picture.
  void add_all();
  bool empty() const;
  /// Returns the rectangle in pixels from the lower left corner of a picture of the given size.
  Eigen::AlignedBox2i pixels(int width_px, int height_px) const;

 private:
  const View& view_;
  float margin_;
  Eigen::AlignedBox2f area_;  ///< rectangle in normalized coordinates, from -1 to 1
};

/// Creates the view of a sub-frame. The depth buffer has 1 at the near plane and 0 at the far plane, which
/// keeps the precision of floats at large distances.
View make_view(const Camera& camera, const SampleOffsets& offsets, int width_px, int height_px);

/// Maps the square [-0.5, 0.5]^2 to the unit disc with equal areas (Shirley and Chiu, 1997).
Vector2f square_to_disc(const Vector2f& p);

/// Returns the unit direction to a point of the sun's disc. `offset`: in [-0.5, 0.5]^2.
Vector3f jittered_sun(const Sun& sun, const Vector2f& offset);

/// Computes the uniforms of a sub-frame. `time`: time of clouds and waves [s].
FrameUniforms make_frame(const View& view, const Sun& sun, const Environment& environment,
                         const SampleOffsets& offsets, float time, int height_px);

}  // namespace offstage::render
