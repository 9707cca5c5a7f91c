#pragma once
/// The keys of an entry of `lights`: the sun, lamps, and lights of model files.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<SunLight> {
  static constexpr const char* kName = "sun";
  static constexpr const char* kHelp = "Parallel light. A scene has at most one sun.";
  static Fields<SunLight> fields() {
    using T = SunLight;
    return {{"direction", &T::direction, "direction towards the sun, above the horizon", "", kDirection},
            {"color", &T::color, "colour of the light"},
            {"intensity", &T::intensity, "brightness of a white surface that faces the sun", "", kBrightness},
            {"size_deg", &T::size_deg, "angular diameter of the sun's disc; larger: softer shadows",
             "degrees", between(0, 90)},
            {"shadows", &T::shadows, "whether the light casts shadows"}};
  }
};
template <>
struct Table<LampBase> {
  static Fields<LampBase> fields() {
    using T = LampBase;
    return {
        {"body", &T::body, "name of the body that carries the light; empty: the light stays in the world"},
        {"position", &T::position, "position of the light, in the world or in the frame of `body`", "m"},
        {"color", &T::color, "colour of the light"},
        {"intensity", &T::intensity,
         "brightness of a white surface that faces the light 1 m away; a number or a curve over time", "",
         kBrightness},
        {"shadows", &T::shadows, "whether the light casts shadows"}};
  }
};
template <>
struct Table<PointLight> {
  static constexpr const char* kName = "point_light";
  static constexpr const char* kHelp = "A glowing ball: a bulb, a fire.";
  static Fields<PointLight> fields() {
    using T = PointLight;
    return Fields<T>{{"radius", &T::radius, "radius of the ball; larger: softer shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<SpotLight> {
  static constexpr const char* kName = "spot_light";
  static constexpr const char* kHelp = "A cone of light.";
  static Fields<SpotLight> fields() {
    using T = SpotLight;
    return Fields<T>{
        {"target", &T::target, "point that the light aims at, in the world or in the frame of `body`", "m"},
        {"angle_deg", &T::angle_deg, "full angle of the cone", "degrees", between(1, 150)},
        {"softness", &T::softness,
         "fraction of the cone over which the light fades to zero at its edge; 0: a sharp edge", "",
         kFraction},
        {"radius", &T::radius, "radius of the lamp; larger: softer shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<AreaLight> {
  static constexpr const char* kName = "area_light";
  static constexpr const char* kHelp = "A glowing rectangle: a window, a lamp with a large screen.";
  static Fields<AreaLight> fields() {
    using T = AreaLight;
    return Fields<T>{
        {"target", &T::target, "point that the light aims at, in the world or in the frame of `body`", "m"},
        {"size", &T::size, "width and height of the rectangle; larger: softer shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<ModelLights> {
  static constexpr const char* kName = "model_lights";
  static constexpr const char* kHelp =
      "Lights of the glTF file that a body shows (KHR_lights_punctual). They move with the body and with the "
      "animation that the body plays. Their candela and lux are converted by 1 / pi: a white surface that "
      "faces a lamp of 1 cd at a distance of 1 m has a luminance of 1 / pi cd/m^2, and 1 cd/m^2 is the "
      "brightness 1. `offstage info FILE` lists the lights of a file.";
  static Fields<ModelLights> fields() {
    using T = ModelLights;
    return {
        {"body", &T::body, "name of the body that shows the file", kRequired},
        {"name", &T::name, "name of the light's node in the file; empty: all lights"},
        {"intensity", &T::intensity,
         "factor of the intensities in the file; files that Blender wrote in watts need about 0.001", "",
         kBrightness},
        {"radius", &T::radius, "radius of point and spot lights, which have none in the file", "m",
         kPositive},
        {"size_deg", &T::size_deg, "angular diameter of a directional light, which becomes the scene's sun",
         "degrees", between(0, 90)},
        {"shadows", &T::shadows, "whether the lights cast shadows"}};
  }
};
template <>
struct Tags<Light> {
  static constexpr const char* kName = "light";
  static constexpr const char* kHelp =
      "A light source in addition to the sky. With an empty list of lights, only the sky gives light.";
  static constexpr std::array kTags = {"sun", "point", "spot", "area", "model"};
  static constexpr bool kRequired = false;
};

}  // namespace offstage::producer
