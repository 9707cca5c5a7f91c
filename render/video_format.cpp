#include "render/video_format.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <stdexcept>

namespace offstage::render {
namespace {

using Options = std::vector<std::string>;

/// Options for conversion from full-range sRGB to limited-range BT.709 in the given pixel format, with the
/// matching tags.
Options yuv(const std::string& pixel_format, Options options) {
  // Options like -color_trc do not tag the film since FFmpeg 7, so a filter sets the tags.
  const std::string filter =
      "scale=in_range=full:out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+full_chroma_inp+"
      "bitexact,format=" +
      pixel_format + ",setparams=colorspace=bt709:color_primaries=bt709:color_trc=iec61966-2-1:range=tv";
  options.insert(options.end(), {"-vf", filter});
  return options;
}

std::vector<VideoFormat> make_formats() {
  const Options h264 = {"-preset", "medium", "-crf", "18"};
  Options h264_mp4 = h264;
  h264_mp4.insert(h264_mp4.end(), {"-movflags", "+faststart"});
  const Options vp9 = {"-crf",      "24", "-b:v",          "0", "-deadline", "good",
                       "-cpu-used", "4",  "-tile-columns", "2"};
  Options vp9_alpha = vp9;  // alternate reference frames cannot have alpha
  vp9_alpha.insert(vp9_alpha.end(), {"-auto-alt-ref", "0"});
  const Options prores = {"-profile:v", "4444", "-vendor", "apl0"};
  // Each frame has its own palette, because a palette for the whole film would need all frames in memory.
  const Options gif = {"-filter_complex",
                       "split[a][b];[a]palettegen=stats_mode=single[p];"
                       "[b][p]paletteuse=new=1:dither=bayer:bayer_scale=3:diff_mode=rectangle",
                       "-loop", "0"};
  const Options webp = {"-quality", "90", "-loop", "0", "-pix_fmt", "bgra"};
  const Options apng = {"-pred", "up", "-plays", "0", "-pix_fmt", "rgb24"};
  const Options apng_alpha = {"-pred", "up", "-plays", "0", "-pix_fmt", "rgba"};
  return {
      {".mp4", "libx264", "mp4", false, true, 1000, yuv("yuv420p", h264_mp4), {}},
      {".webm", "libvpx-vp9", "webm", true, true, 1000, yuv("yuv420p", vp9), yuv("yuva420p", vp9_alpha)},
      {".mov", "prores_ks", "mov", true, false, 1000, yuv("yuv444p10le", prores),
       yuv("yuva444p10le", prores)},
      {".mkv", "libx264", "matroska", false, true, 1000, yuv("yuv420p", h264), {}},
      {".gif", "gif", "gif", false, false, 50, gif, {}},
      {".webp", "libwebp_anim", "webp", true, false, 1000, webp, webp},
      {".apng", "apng", "apng", true, false, 1000, apng, apng_alpha},
      {".png", "apng", "apng", true, false, 1000, apng, apng_alpha},
  };
}

std::string shortest(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr;
  return {text.data(), end};
}

}  // namespace

std::span<const VideoFormat> video_formats() {
  static const std::vector<VideoFormat> formats = make_formats();
  return formats;
}

std::vector<std::string> video_endings() {
  std::vector<std::string> endings;
  for (const VideoFormat& format : video_formats()) endings.emplace_back(format.extension);
  return endings;
}

bool keeps_alpha(const std::string& ending) {
  const auto formats = video_formats();
  return std::ranges::any_of(formats,
                             [&](const VideoFormat& f) { return f.extension == ending && f.keeps_alpha; });
}

const VideoFormat& video_format(const VideoDef& def) {
  const std::string file = def.path.string();
  std::string extension = def.path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto formats = video_formats();
  const auto format = std::find_if(formats.begin(), formats.end(),
                                   [&](const VideoFormat& f) { return extension == f.extension; });
  if (format == formats.end()) {
    std::string endings;
    for (const VideoFormat& f : formats) endings += std::string(" ") + f.extension;
    throw std::invalid_argument(file + ": the ending names no video format; use one of" + endings);
  }
  const std::string size = std::to_string(def.width_px) + "x" + std::to_string(def.height_px);
  if (def.width_px <= 0 || def.height_px <= 0 || def.width_px > 16384 || def.height_px > 16384) {
    throw std::invalid_argument(file + ": size " + size + ": width and height must be 1 to 16384 pixels");
  }
  if (format->needs_even_size && (def.width_px % 2 != 0 || def.height_px % 2 != 0)) {
    const std::string even = std::to_string(def.width_px + def.width_px % 2) + "x" +
                             std::to_string(def.height_px + def.height_px % 2);
    throw std::invalid_argument(file + ": " + extension + " needs an even width and height, not " + size +
                                "; use " + even + ", or .mov, .webp or .apng");
  }
  const bool positive = def.fps.numerator > 0 && def.fps.denominator > 0;
  if (!positive || def.fps.per_second() > format->max_fps) {
    throw std::invalid_argument(file + ": " + def.fps.text() + " frames per second is not in (0, " +
                                shortest(format->max_fps) + "], the range of " + extension);
  }
  if (def.alpha && !format->keeps_alpha) {
    throw std::invalid_argument(
        file + ": " + extension +
        " has no transparency; use .webm, .mov, .webp or .apng, or an opaque background");
  }
  return *format;
}

std::vector<std::string> encoder_command(const std::string& ffmpeg, const VideoDef& def,
                                         const VideoFormat& format, const std::filesystem::path& output) {
  Options command = {ffmpeg,
                     "-hide_banner",
                     "-loglevel",
                     "error",
                     "-f",
                     "rawvideo",
                     "-pixel_format",
                     def.alpha ? "rgba" : "rgb0",
                     "-video_size",
                     std::to_string(def.width_px) + "x" + std::to_string(def.height_px),
                     "-framerate",
                     def.fps.text(),
                     "-i",
                     "pipe:0",
                     "-c:v",
                     format.encoder};
  const Options& options = def.alpha ? format.transparent : format.opaque;
  command.insert(command.end(), options.begin(), options.end());
  // The number of threads is fixed, and the file has no dates or versions, so that the same frames give the
  // same file on any machine.
  command.insert(command.end(), {"-threads", "4", "-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v",
                                 "+bitexact", "-f", format.container, "-y", "file:" + output.string()});
  return command;
}

}  // namespace offstage::render
