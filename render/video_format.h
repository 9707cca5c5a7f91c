#pragma once
/// The encoder, the container and their options for each video file name. Private to render.

#include <span>
#include <string>
#include <vector>

#include "render/sink.h"

namespace offstage::render {

struct VideoFormat {
  const char* extension;
  const char* encoder;
  const char* container;
  bool keeps_alpha;
  bool needs_even_size;  ///< whether colour is stored at half size in both directions
  double max_fps;
  std::vector<std::string> opaque;       ///< encoder options without alpha
  std::vector<std::string> transparent;  ///< encoder options with alpha
};

std::span<const VideoFormat> video_formats();

/// Returns the format that the ending of a video's name selects. Throws std::invalid_argument with advice if
/// the format cannot represent it.
const VideoFormat& video_format(const VideoDef& def);

/// Returns the whole command; ffmpeg reads the frames from its standard input.
std::vector<std::string> encoder_command(const std::string& ffmpeg, const VideoDef& def,
                                         const VideoFormat& format, const std::filesystem::path& output);

}  // namespace offstage::render
