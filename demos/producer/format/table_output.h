#pragma once
/// The key `output`: frame rate and length of the film, and its channels.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Names<render::Channel> {
  static constexpr std::array kNames = {"depth", "normal", "id", "motion"};
};
template <>
struct Names<render::ChannelFormat> {
  static constexpr std::array kNames = {"exr", "png"};
};
template <>
struct Table<OutputSettings> {
  static constexpr const char* kName = "output";
  static constexpr const char* kHelp =
      "Frame rate and length of the film, and the channels written beside its frames.";
  static Fields<OutputSettings> fields() {
    using T = OutputSettings;
    return {{"fps", &T::fps, "frames per second: a number, or an exact fraction such as \"30000/1001\"",
             "1/s", between(1, 1000)},
            {"duration", &T::duration, "length of the film", "s", over(0, 86400)},
            {"start", &T::start, "time of the first frame; earlier times are simulated but not shown", "s",
             between(0, 86400)},
            {"channels", &T::channels,
             "channels written beside each frame (or into FILM.channels beside a video): depth [m], normal, "
             "id, motion [px since the previous frame]"},
            {"channel_format", &T::channel_format,
             "exr: FRAME.exr with all channels as floating-point numbers; png: FRAME.depth.png (16 bits, mm) "
             "and so on, each with its scale in its comment"}};
  }
};

}  // namespace offstage::producer
