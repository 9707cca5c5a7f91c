#pragma once
/// Destinations of finished frames. A sink gets frames in ascending order of their number, from one thread.

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
  /// Writes a frame. Throws FileError if this fails or the encoder ended early; the message then contains the
  /// last output of the encoder.
  virtual void write(int frame, const Image& image) = 0;
  /// Returns whether the sink stores linear light. If so, write_linear() must be called after each write().
  virtual bool needs_linear() const { return false; }
  /// Writes the linear light of a frame, times the exposure, with premultiplied alpha.
  virtual void write_linear(int, const HdrImage&) {}
  /// Completes the output; a video has a temporary name until then. Without this call the destructor discards
  /// partial output.
  virtual void close() = 0;
};

/// Returns the file of a frame: `pattern` has a run of '#' in its file name, which is replaced by the number
/// with at least as many digits.
std::filesystem::path frame_path(const std::filesystem::path& pattern, int frame);

struct VideoDef {
  /// Name of the video. Its ending selects the encoder: .mp4 .webm .mov .mkv .gif .webp .apng; .png is an
  /// animated PNG here.
  std::filesystem::path path;
  int width_px = 0, height_px = 0;
  FrameRate fps;
  /// Whether the video has transparency: .webm, .mov, .webp, .apng and .png support it; other formats are
  /// refused.
  bool alpha = false;
  StopTest stop = {};  ///< ends the wait for an encoder that does not read a frame or does not end
};

/// Checks before any frame is drawn that the video can be made. Throws UnavailableError if ffmpeg or the
/// encoder for this file is missing (with the name of the package), or std::invalid_argument if the size or
/// alpha is not possible with this format (with advice).
void check_video(const VideoDef& def);
/// Creates a sink that runs ffmpeg (or the program in OFFSTAGE_FFMPEG) as a child process in its own process
/// group. It gets raw frames and writes to an OutputFile, which is renamed when all frames are found in it.
/// Colours are BT.709 with sRGB's curve, alpha is straight; the same frames give the same bytes on any number
/// of cores. GIF has a palette per frame, so that the memory does not grow with the length of the film.
/// Throws as check_video does, and FileError if the file cannot be created.
std::unique_ptr<FrameSink> make_video_sink(const VideoDef& def);

/// Creates a sink that writes raw top-down frames to standard output: RGBA bytes, or yuv4mpeg (4:4:4, BT.709,
/// limited range) if `y4m`. A closed pipe throws FileError; a request to stop while the reader does not read
/// throws StoppedError. Throws std::invalid_argument for an impossible size or rate, and if the output is a
/// terminal.
std::unique_ptr<FrameSink> make_pipe_sink(bool y4m, int width_px, int height_px, FrameRate fps,
                                          StopTest stop = {});

/// Returns the endings of video files, with their dots.
std::vector<std::string> video_endings();
/// Returns whether a video with this ending keeps transparency; false if it is not an ending of a video.
bool keeps_alpha(const std::string& ending);

/// Returns the supported encoders that the installed ffmpeg has, for `doctor`; empty if there is no ffmpeg.
std::vector<std::string> available_encoders();

}  // namespace offstage::render
