#pragma once
/// Private: light that reaches small balls in the air, by rays, for particles.

#include "render/trace/light_sources.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {

class AirLight {
 public:
  /// The arguments must outlive this object.
  AirLight(const RayScene& scene, const LightSources& sources, const SampleOffsets& offsets)
      : scene_(scene), sources_(sources), disc_(sources.sun, sources.sky.sun_direction), offsets_(offsets) {}

  /// Fraction of the sun's light that objects let through to a ball; smoke is not counted. `number`: one in
  /// [0, 1) that the ball keeps, which selects the rays.
  float sun(const Vector3f& center, float radius, float number) const;
  /// Calls each(radiance of a white surface that faces the lamp, unit vector to the lamp) for all lamps that
  /// reach a ball.
  template <class Each>
  void for_each_lamp(const Vector3f& center, float radius, float number, Each&& each) const {
    if (sources_.lamps.empty()) return;
    PixelSampler sampler = sampler_of(number);
    for (const RayLamp& lamp : sources_.lamps) {
      const LampPoint<float> point = lamp.point(from_eigen(center), sampler.next());
      if (!(point.fraction > 0)) continue;
      const Vector3f towards = to_eigen(point.towards);
      Vector3f light = to_eigen(point.arriving);
      if (lamp.def().shadows && point.distance > radius)
        light = light.cwiseProduct(
            scene_.transmittance(center + radius * towards, towards, point.distance - radius));
      each(light, towards);
    }
  }
  /// Radiance of a white ball so small that lamps light it from all sides.
  Vector3f lamps_around(const Vector3f& center, float radius, float number) const;

 private:
  PixelSampler sampler_of(float number) const;

  const RayScene& scene_;
  const LightSources& sources_;
  SunDisc disc_;
  SampleOffsets offsets_;
};

}  // namespace offstage::render
