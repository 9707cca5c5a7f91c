#pragma once
/// Private: traces the light of sun and lamps that particles receive. Each particle is a small ball.

#include "render/trace/light_sources.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {

class AirLight {
 public:
  /// Prepares the tracing of a sub-frame. All arguments must outlive this object.
  AirLight(const RayScene& scene, const LightSources& sources, const SampleOffsets& offsets)
      : scene_(scene), sources_(sources), disc_(sources.sun, sources.sky.sun_direction), offsets_(offsets) {}

  /// Returns the fraction of the sun's light that reaches a ball past all objects, without the effect of
  /// smoke. `number`: pseudo-random and constant for the ball, in [0, 1); it selects the rays.
  float sun(const Vector3f& center, float radius, float number) const;
  /// Calls each(light, towards) for each lamp that shines in the direction of a ball. `light`: radiance of a
  /// white surface there that faces the lamp, with shadows. `towards`: unit vector to the lamp.
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
  /// Returns the radiance of a white particle that scatters the light of lamps equally in all directions.
  Vector3f lamps_around(const Vector3f& center, float radius, float number) const;

 private:
  PixelSampler sampler_of(float number) const;

  const RayScene& scene_;
  const LightSources& sources_;
  SunDisc disc_;
  SampleOffsets offsets_;
};

}  // namespace offstage::render
