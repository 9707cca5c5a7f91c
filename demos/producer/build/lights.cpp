#include "producer/build/lights.h"

#include <algorithm>

#include "effects/distribution.h"
#include "producer/base/to_float.h"

namespace offstage::producer {
namespace {

/// Albedo of the ground plane, if there is a visible one.
std::optional<Eigen::Vector3f> ground_albedo(const Scene& scene) {
  for (const Body& body : scene.bodies) {
    if (!std::holds_alternative<sim::Plane>(body.shape) || !body.visible) continue;
    const auto material = std::ranges::find(scene.materials, body.material, &Material::name);
    if (material == scene.materials.end()) return Material().color.rgb();
    const bool even = material->pattern == render::Pattern::checker;
    const float second = material->pattern == render::Pattern::none ? 0.f : even ? 0.5f : 0.2f;
    const Eigen::Vector3f a = material->color.rgb(), b = material->pattern_color.rgb();
    return Eigen::Vector3f((1 - to_float(material->metallic)) * (a + second * (b - a)));
  }
  return {};
}

struct LampOf {
  double time;
  const BodyPlaces& places;
  const std::vector<BodySample>& moving;

  render::Lamp base(const LampBase& l) const {
    return {.position = world(l, l.position),
            .intensity = to_float(effects::mean(l.intensity, time)) * l.color.rgb(),
            .shadows = l.shadows};
  }
  Eigen::Vector3f world(const LampBase& l, const Vec3& point) const {
    const Eigen::Vector3f p = point.cast<float>();
    return l.body.empty() ? p : Eigen::Vector3f(places.at(l.body, moving) * p);
  }
  Eigen::Vector3f direction(const LampBase& l, const Vec3& target) const {
    return (world(l, target) - world(l, l.position)).normalized();
  }

  std::optional<render::Lamp> operator()(const SunLight&) const { return {}; }
  std::optional<render::Lamp> operator()(const PointLight& l) const {
    render::Lamp lamp = base(l);
    lamp.radius = to_float(l.radius);
    return lamp;
  }
  std::optional<render::Lamp> operator()(const SpotLight& l) const {
    render::Lamp lamp = base(l);
    lamp.radius = to_float(l.radius);
    lamp.direction = direction(l, l.target);
    lamp.cone_deg = to_float(l.angle_deg);
    lamp.softness = to_float(l.softness);
    return lamp;
  }
  std::optional<render::Lamp> operator()(const AreaLight& l) const {
    render::Lamp lamp = base(l);
    lamp.direction = direction(l, l.target);
    lamp.size = l.size.cast<float>();
    lamp.radius = 0.25f * lamp.size.sum();
    return lamp;
  }
};

}  // namespace

render::Sun sun_of(const Scene& scene) {
  for (const Light& light : scene.lights)
    if (const auto* l = std::get_if<SunLight>(&light))
      return {.direction = l->direction.normalized().cast<float>(),
              .color = l->color.rgb(),
              .intensity = to_float(l->intensity),
              .size_deg = to_float(l->size_deg),
              .shadows = l->shadows};
  return {.intensity = 0, .shadows = false};
}

render::Environment environment_of(const Scene& scene) {
  const EnvironmentSettings& e = scene.environment;
  render::Environment environment{.zenith = e.zenith.rgb(),
                                  .horizon = e.horizon.rgb(),
                                  .intensity = to_float(e.intensity),
                                  .clouds = to_float(e.clouds),
                                  .fog = to_float(e.fog),
                                  .visible = e.background == Background::sky};
  if (e.picture) {
    environment.picture_turn_deg = to_float(e.picture->turn_deg);
    environment.picture_visible = e.picture->visible;
  }
  if (e.ground)
    environment.ground = e.ground->rgb();
  else
    environment.ground_albedo = ground_albedo(scene);
  return environment;
}

std::vector<render::Lamp> lamps_of(const Scene& scene, double time, const BodyPlaces& places,
                                   const std::vector<BodySample>& moving) {
  std::vector<render::Lamp> lamps;
  const LampOf lamp_of{time, places, moving};
  for (const Light& light : scene.lights)
    if (const auto lamp = std::visit(lamp_of, light)) lamps.push_back(*lamp);
  return lamps;
}

}  // namespace offstage::producer
