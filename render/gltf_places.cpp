#include "render/gltf_places.h"

#include <numbers>

namespace offstage::render {
namespace {

float in_degrees(double angle) {
  return static_cast<float>(angle * 180 / std::numbers::pi);
}

}  // namespace

std::optional<Model::Camera> gltf_camera(GltfFile& file, const GltfValue& node) {
  const auto index = node.index("camera", file.count("cameras"));
  if (!index) return std::nullopt;
  const GltfValue source = file.item("cameras", *index);
  Model::Camera camera;
  camera.name = node.text("name", source.text("name", "camera"));
  const std::string type = source.text("type");
  camera.perspective = type == "perspective";
  if (!camera.perspective && type != "orthographic") {
    file.warn(source.place() + ": its type '" + type + "' is unknown; the camera is ignored");
    return std::nullopt;
  }
  if (!camera.perspective) return camera;
  const double fov = source.child("perspective").number("yfov", 0);
  if (!(fov > 1e-4 && fov < std::numbers::pi - 1e-4)) {
    file.warn(source.place() + ": its yfov is not between 0 and pi; the camera is ignored");
    return std::nullopt;
  }
  camera.fov_deg = in_degrees(fov);
  return camera;
}

std::optional<Model::Light> gltf_light(GltfFile& file, const GltfValue& node) {
  const GltfValue lights = file.root().extension("KHR_lights_punctual");
  const auto index = node.extension("KHR_lights_punctual").index("light", lights.count("lights"));
  if (!index) return std::nullopt;
  const GltfValue source = lights.item("lights", *index);
  const auto left_out = [&](const std::string& why) {
    file.warn(source.place() + ": " + why + "; the light is ignored");
    return std::nullopt;
  };
  using Kind = Model::Light::Kind;
  Model::Light light;
  light.name = node.text("name", source.text("name", "light"));
  const std::string type = source.text("type");
  if (type == "directional")
    light.kind = Kind::directional;
  else if (type == "point")
    light.kind = Kind::point;
  else if (type == "spot")
    light.kind = Kind::spot;
  else
    return left_out("its type '" + type + "' is unknown");
  light.color = source.numbers<3>("color", Eigen::Vector3d::Ones()).cast<float>();
  light.intensity = static_cast<float>(source.number("intensity", 1));
  light.range_m = static_cast<float>(source.number("range", 0));
  if (!(light.color.minCoeff() >= 0 && light.intensity >= 0) || !light.color.allFinite() ||
      !std::isfinite(light.intensity))
    return left_out("its colour or intensity is negative or too large");
  if (!std::isfinite(light.range_m)) light.range_m = 0;
  if (light.kind == Kind::spot) {
    const GltfValue spot = source.child("spot");
    const double outer = spot.number("outerConeAngle", std::numbers::pi / 4);
    const double inner = spot.number("innerConeAngle", 0);
    if (!(inner >= 0 && inner <= outer && outer > 0 && outer <= std::numbers::pi / 2 + 1e-6))
      return left_out("its cone angles are not 0 <= inner <= outer <= pi / 2");
    light.outer_deg = std::min(in_degrees(outer), 90.0f);
    light.inner_deg = std::min(in_degrees(inner), light.outer_deg);
  }
  return light;
}

}  // namespace offstage::render
