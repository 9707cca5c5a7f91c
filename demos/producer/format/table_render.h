#pragma once
/// The key `render`: size, quality, shutter and exposure of the picture.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Names<Quality> {
  static constexpr std::array kNames = {"draft", "preview", "final"};
};
template <>
struct Names<Metering> {
  static constexpr std::array kNames = {"fixed", "automatic"};
};
template <>
struct Names<render::ToneCurve> {
  static constexpr std::array kNames = {"filmic", "linear"};
};
template <>
struct Table<RenderSettings> {
  static constexpr const char* kName = "render";
  static constexpr const char* kHelp = "The picture. These settings do not change the simulation.";
  static Fields<RenderSettings> fields() {
    using T = RenderSettings;
    return {
        {"size", &T::size, "width and height of the picture; most video formats need even numbers", "pixels",
         between(16, 16384)},
        {"quality", &T::quality,
         "number of sub-frames whose mean is a frame: `draft` 1, `preview` 4, `final` 16; more sub-frames "
         "smooth edges, motion blur and soft shadows, and take more time"},
        {"shutter", &T::shutter,
         "fraction of the time between two frames during which the shutter is open; larger: more motion "
         "blur; 0: none",
         "", kFraction},
        {"exposure", &T::exposure,
         "factor of the brightness of the whole picture; a number or a curve over time", "", kPositive},
        {"metering", &T::metering,
         "`fixed` uses `exposure` unchanged; `automatic` also brings each frame to the same average "
         "brightness"},
        {"bloom", &T::bloom, "fraction of very bright light that spreads as glow; 0: none", "", kNotNegative},
        {"tone_curve", &T::tone_curve,
         "mapping from light to picture values: `filmic` compresses dark and bright parts smoothly, `linear` "
         "clips"}};
  }
};

}  // namespace offstage::producer
