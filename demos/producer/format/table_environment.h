#pragma once
/// The key `environment`: the sky, its light, and fog.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Names<Background> {
  static constexpr std::array kNames = {"sky", "transparent"};
};
template <>
struct Table<SkyPictureSettings> {
  static constexpr const char* kName = "sky picture";
  static constexpr const char* kHelp =
      "A picture of the whole sky in equirectangular projection, twice as wide as high. It lights the scene "
      "in place of the colours, and is the background. A scene with a picture has no sun by default.";
  static Fields<SkyPictureSettings> fields() {
    using T = SkyPictureSettings;
    return {
        {"file", &T::file,
         "picture relative to the scene: Radiance HDR or OpenEXR with linear light, or PNG, JPEG or WebP in "
         "sRGB. Its centre is at -z, its right half at +x",
         kRequired},
        {"turn_deg", &T::turn_deg,
         "angle by which the picture is turned about the vertical axis, counter-clockwise as seen from above",
         "degrees"},
        {"blur_deg", &T::blur_deg,
         "standard deviation of a blur of the background, which does not change the light; 0: sharp",
         "degrees", between(0, 90)},
        {"visible", &T::visible,
         "whether the background shows the picture; false: the picture only lights the scene and appears in "
         "reflections, and the background shows the colours"}};
  }
};
template <>
struct Table<EnvironmentSettings> {
  static constexpr const char* kName = "environment";
  static constexpr const char* kHelp = "The sky, its light, and fog.";
  static Fields<EnvironmentSettings> fields() {
    using T = EnvironmentSettings;
    return {{"zenith", &T::zenith, "colour of the sky overhead"},
            {"horizon", &T::horizon, "colour of the sky at the horizon, and of the fog"},
            {"ground", &T::ground,
             "colour below the horizon, and of the light from below; default: the light that a ground plane "
             "would reflect"},
            {"intensity", &T::intensity, "factor of the sky's brightness and of the ambient light", "",
             kBrightness},
            {"fog", &T::fog,
             "density of the fog: the fraction exp(-fog * distance) of the light passes. 0: no fog, but an "
             "infinite plane still blends into the sky in the last quarter of a degree below its horizon",
             "1/m", kNotNegative},
            {"clouds", &T::clouds, "fraction of the sky that is covered by clouds", "", kFraction},
            {"background", &T::background,
             "`sky` draws the sky, and frames have no alpha channel; `transparent` draws none, and all "
             "frames have an alpha channel"},
            {"picture", &T::picture,
             "a picture of the sky in place of the colours and clouds; `intensity` scales it"}};
  }
};

}  // namespace offstage::producer
