#include "producer/build/lights.h"

#include <algorithm>
#include <numbers>

#include "effects/distribution.h"
#include "producer/base/to_float.h"
#include "producer/build/shown_model.h"

namespace offstage::producer {
namespace {

/// Returns the albedo of the ground plane, if there is a visible one.
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
  // The lights of a file are several lamps; see lamps_of().
  std::optional<render::Lamp> operator()(const ModelLights&) const { return {}; }
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

// A surface that reflects all light has the radiance E / pi under the irradiance E.
constexpr float kPerCandela = 1 / std::numbers::pi_v<float>;

/// Calls each(settings, light, body) for every light of a model file that an entry of `lights` selects.
template <class Each>
void for_each_file_light(const Light& light, const Scene& scene, const ModelLibrary& models, Each each) {
  const auto* settings = std::get_if<ModelLights>(&light);
  if (!settings) return;
  const Body& body = body_of(scene, settings->body);
  for (const FileLight& own : models.model(shown_model(body, models).value().file).lights)
    if (has_light(*settings, own)) each(*settings, own, body);
}

render::Lamp lamp_of(const ModelLights& settings, const FileLight& light,
                     const Eigen::Affine3f& world_from_light) {
  render::Lamp lamp{.position = world_from_light.translation(),
                    .intensity = kPerCandela * to_float(settings.intensity) * light.intensity * light.color,
                    .radius = to_float(settings.radius),
                    .direction = (world_from_light.linear() * -Eigen::Vector3f::UnitZ()).normalized(),
                    .shadows = settings.shadows};
  if (light.kind == FileLight::Kind::spot) {
    lamp.cone_deg = 2 * light.outer_deg;
    lamp.softness = 1 - light.inner_deg / light.outer_deg;
    lamp.squared_edge = true;
  }
  return lamp;
}

}  // namespace

render::Sun sun_of(const Scene& scene, const ModelLibrary& models) {
  for (const Light& light : scene.lights)
    if (const auto* l = std::get_if<SunLight>(&light))
      return {.direction = l->direction.normalized().cast<float>(),
              .color = l->color.rgb(),
              .intensity = to_float(l->intensity),
              .size_deg = to_float(l->size_deg),
              .shadows = l->shadows};
  render::Sun sun{.intensity = 0, .shadows = false};
  for (const Light& light : scene.lights)
    for_each_file_light(light, scene, models,
                        [&](const ModelLights& settings, const FileLight& own, const Body& body) {
                          if (own.kind != FileLight::Kind::directional) return;
                          const Eigen::Vector3f towards =
                              body.orientation.cast<float>() *
                              (pose_in_body(body, own, models, 0).linear() * Eigen::Vector3f::UnitZ());
                          sun = {.direction = towards.normalized(),
                                 .color = own.color,
                                 .intensity = kPerCandela * to_float(settings.intensity) * own.intensity,
                                 .size_deg = to_float(settings.size_deg),
                                 .shadows = settings.shadows};
                        });
  return sun;
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

std::vector<render::Lamp> lamps_of(const Scene& scene, const ModelLibrary& models, double time,
                                   const BodyPlaces& places, const std::vector<BodySample>& moving) {
  std::vector<render::Lamp> lamps;
  const LampOf own_lamp{time, places, moving};
  for (const Light& light : scene.lights) {
    if (const auto lamp = std::visit(own_lamp, light)) lamps.push_back(*lamp);
    for_each_file_light(
        light, scene, models, [&](const ModelLights& settings, const FileLight& own, const Body& body) {
          if (own.kind == FileLight::Kind::directional) return;
          lamps.push_back(
              lamp_of(settings, own, places.at(body.name, moving) * pose_in_body(body, own, models, time)));
        });
  }
  return lamps;
}

std::vector<std::string> lamp_names(const Scene& scene, const ModelLibrary& models) {
  std::vector<std::string> names;
  for (const Light& light : scene.lights) {
    if (!std::holds_alternative<SunLight>(light) && !std::holds_alternative<ModelLights>(light))
      names.emplace_back();
    for_each_file_light(light, scene, models, [&](const ModelLights&, const FileLight& own, const Body&) {
      if (own.kind != FileLight::Kind::directional) names.push_back(own.name);
    });
  }
  return names;
}

}  // namespace offstage::producer
