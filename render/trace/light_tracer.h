#pragma once
/// Private: computes the light that arrives at the visible surfaces of a sub-frame by rays: sun and lamps
/// with their shadows, the light from the sky and from other surfaces, and mirror images. The shaders combine
/// it with the material.

#include <array>
#include <cstdint>
#include <vector>

#include "render/opacity_grid.h"
#include "render/sky.h"
#include "render/stage.h"
#include "render/trace/light_filter.h"
#include "render/trace/ray_scene.h"
#include "render/trace/sampler.h"

namespace offstage::render {

/// The visible opaque surfaces, one value per pixel, rows from the bottom up.
struct SurfaceBuffer {
  int width_px = 0, height_px = 0;
  /// Position; w: roughness, plus kMirrors and kCloth; negative: nothing is visible.
  std::vector<Vector4f> places;
  /// Smooth normal and normal of the triangle, both on the visible side, in octahedral coordinates.
  std::vector<std::array<uint16_t, 4>> normals;

  static constexpr float kMirrors = 2, kCloth = 4;
};

/// Light at the surfaces, in the units of the shaders: the radiance of a white surface. Rows from the bottom
/// up.
struct LightBuffer {
  LightBuffer(int width_px, int height_px);

  int width_px, height_px;
  std::vector<Vector4f> direct;  ///< share of the sun that is visible; yzw: diffuse light of lamps
  std::vector<Vector4f>
      highlights;  ///< lobes of lamps, without reflectance; w: Fresnel factor. Empty: no lamps
  std::vector<Vector4f> mirrored;  ///< light from the mirrored direction; w: 1 where it was computed
  /// Half the size, rounded up: light from the sky and other surfaces; w: distance along the view axis of the
  /// pixel for which it was computed; 0: nothing is visible.
  std::vector<Vector4f> around;
  std::vector<Vector4f> around_normals;  ///< smooth normal of that pixel
  int half_width() const { return (width_px + 1) / 2; }
  int half_height() const { return (height_px + 1) / 2; }

  LightFilter direct_filter, around_filter;
};

/// A lamp with its axes.
struct RayLamp {
  explicit RayLamp(const Lamp& lamp);
  /// Light that a surface at `place` would receive from the point (u, v) of the lamp if it faced it;
  /// `towards` and `distance` lead there.
  Vector3f light(const Vector3f& place, const Vector2f& uv, Vector3f& towards, float& distance) const;

  Lamp def;
  Vector3f right, up;
  float cone_factor = 0, cone_offset = 1;
};

struct LightSources {
  Sun sun;
  SkyModel sky;
  float fog = 0;
  std::vector<RayLamp> lamps;
  const OpacityGrid* smoke = nullptr;  ///< null: none
};

class LightTracer {
 public:
  LightTracer(const RayScene& scene, const LightSources& sources);

  /// `eye` and `forward`: of the view in which the surfaces were drawn. `pixel_m`: width of a pixel at
  /// distance 1.
  void trace(const SurfaceBuffer& surfaces, const Vector3f& eye, const Vector3f& forward, float pixel_m,
             const SampleOffsets& offsets, LightBuffer& light) const;

  /// Radiance that arrives from `direction` at `from`. `cone`: angle that the ray stands for [rad]. `met`, if
  /// not null, gets the distance of what the ray meets first, and is unchanged if it meets nothing.
  Vector3f radiance(Vector3f from, Vector3f direction, float cone, PixelSampler& sampler,
                    float* met = nullptr) const;

 private:
  struct Point;  ///< a visible surface
  Vector3f lamps_at(const Vector3f& place, const Vector3f& normal, const Vector3f& face,
                    PixelSampler& sampler) const;
  float sun_visibility(const Vector3f& place, const Vector2f& uv) const;
  struct Place;  ///< a pixel of a sub-frame
  void trace_pixel(const SurfaceBuffer& surfaces, const Place& place, LightBuffer& light) const;
  void trace_around(const SurfaceBuffer& surfaces, const Place& place, LightBuffer& light) const;
  void trace_direct(const Point& point, PixelSampler& sampler, Vector4f& direct, Vector4f& highlight) const;
  Vector3f sky_seen(const Vector3f& direction) const;

  const RayScene& scene_;
  const LightSources& sources_;
  Vector3f sun_across_, sun_along_;  ///< radii of the sun's disc at distance 1
};

}  // namespace offstage::render
