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
  std::array<Vector4f, 7> irradiance;  ///< the last two of the nine coefficients are in the w components
  Vector4f ray_center, ray_x, ray_y;
  Vector4f depth;
  Vector4f air;

  Vector3f irradiance_at(std::size_t k) const;  ///< coefficient k of the nine
};

static_assert(offsetof(FrameUniforms, air) == 22 * sizeof(Vector4f));

/// Preprocessor definitions for shaders, which depend on the lighting, such as "LAMPS 1".
using Features = std::vector<std::string>;

/// The eye of one sub-frame: displaced within the lens, looking along `forward`.
struct View {
  Matrix4f clip_from_world;
  Vector3f eye, right, up, forward;
  Vector2f tan_half;  ///< half the width and half the height of the image plane at distance 1
  Vector2f shear;     ///< shift of the image due to lens and pixel offsets, as a fraction of tan_half
  float near_m = 0, far_m = 0;

  /// Whether a ball may be in view; false only if it is outside of one plane of the frustum.
  bool sees(const Vector3f& center, float radius) const;
  float depth_of(const Vector3f& point) const { return forward.dot(point - eye); }
};

/// The rectangle of the picture that covers a set of points, each with a margin around it [m].
class ScreenArea {
 public:
  ScreenArea(const View& view, float margin) : view_(view), margin_(margin) {}
  void add(const Vector3f& place);
  void add_all();
  bool empty() const;
  /// The rectangle in pixels from the lower left corner, for a picture of the given size.
  Eigen::AlignedBox2i pixels(int width_px, int height_px) const;

 private:
  const View& view_;
  float margin_;
  Eigen::AlignedBox2f area_;  ///< rectangle in normalized coordinates, from -1 to 1
};

/// Creates the view of a sub-frame. Depth runs from 1 at the near plane to 0 at the far one, which keeps
/// float precision at large distances.
View make_view(const Camera& camera, const SampleOffsets& offsets, int width_px, int height_px);

/// Maps the square [-0.5, 0.5]^2 to the unit disc with equal areas (Shirley and Chiu, 1997).
Vector2f square_to_disc(const Vector2f& p);

/// The direction towards a point of the sun's disc.
Vector3f jittered_sun(const Sun& sun, const Vector2f& offset);

/// `time`: for clouds and waves [s].
FrameUniforms make_frame(const View& view, const Sun& sun, const Environment& environment,
                         const SampleOffsets& offsets, float time, int height_px);

}  // namespace offstage::render
