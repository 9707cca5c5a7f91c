#pragma once
/// Where finished frames go. A sink gets frames in ascending order of their number, from one thread.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/file_io.h"
#include "render/frame_rate.h"
#include "render/image.h"

namespace offstage::render {

class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Throws FileError, also when the encoder died: with its own last words.
  virtual void write(int frame, const Image& image) = 0;
  /// Completes the output: only now a video appears under its name. Without it the destructor discards what
  /// is partial.
  virtual void close() = 0;
};

/// The file of a frame: `pattern` has a run of '#' in its file name, as long as the number is wide at least.
std::filesystem::path frame_path(const std::filesystem::path& pattern, int frame);

/// One PNG per frame, which carries the settings (encode_png).
std::unique_ptr<FrameSink> make_png_sink(const std::filesystem::path& pattern,
                                         const std::string& settings = {});

struct VideoDef {
  std::filesystem::path
      path;  ///< .mp4 .webm .mov .mkv .gif .webp .apng decide the encoder; .png is animated PNG here
  int width_px = 0, height_px = 0;
  FrameRate fps;
  bool alpha = false;  ///< .webm, .mov, .webp, .apng, .png keep it; others are refused
  StopTest stop = {};  ///< ends the wait for an encoder that takes no frame or does not end
};

/// Throws UnavailableError, before any frame is drawn, if ffmpeg or the encoder this file needs is missing
/// (naming the package), or std::invalid_argument if the size or alpha is not possible with this format (with
/// advice).
void check_video(const VideoDef& def);
/// ffmpeg (or the program that OFFSTAGE_FFMPEG names) as a child process in its own process group, fed raw
/// frames, writing to an OutputFile, which gets its name when all frames are found in it. Colour is BT.709
/// with sRGB's curve, alpha straight; the same frames give the same bytes on any number of cores. GIF has a
/// palette per frame, so that a long film needs no memory. Throws as check_video does, and FileError if the
/// file cannot be made.
std::unique_ptr<FrameSink> make_video_sink(const VideoDef& def);

/// Raw top-down frames on standard output: rgba bytes, or yuv4mpeg (4:4:4, BT.709, limited range) if `y4m`. A
/// closed pipe throws FileError; one whose reader waits, StoppedError after a request to stop. Throws
/// std::invalid_argument for an impossible size or rate, and on a terminal.
std::unique_ptr<FrameSink> make_pipe_sink(bool y4m, int width_px, int height_px, FrameRate fps,
                                          StopTest stop = {});

/// The endings of video files, with their dots.
std::vector<std::string> video_endings();
/// Whether a video of this ending keeps transparency; false for an ending that is none.
bool keeps_alpha(const std::string& ending);

/// Encoders ffmpeg offers among those used here, for `doctor`; empty if there is no ffmpeg.
std::vector<std::string> available_encoders();

}  // namespace offstage::render
