#pragma once
/// Destinations of finished frames. A sink gets frames in ascending order of their number, from one thread.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/frame_rate.h"
#include "render/image.h"

namespace offstage::render {

class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Writes a frame. Throws FileError; if the encoder died, with the encoder's last messages.
  virtual void write(int frame, const Image& image) = 0;
  /// Completes the output: only now a video appears under its name. Without it the destructor discards what
  /// is partial.
  virtual void close() = 0;
};

/// Path of a frame: the run of '#' in the file name of `pattern` is replaced by the number, padded with zeros
/// to at least that width.
std::filesystem::path frame_path(const std::filesystem::path& pattern, int frame);

<<<<<<< ours
/// One PNG per frame.
std::unique_ptr<FrameSink> make_png_sink(const std::filesystem::path& pattern);
=======
/// Writes one PNG per frame, which carries the settings (see encode_png).
std::unique_ptr<FrameSink> make_png_sink(const std::filesystem::path& pattern,
                                         const std::string& settings = {});
>>>>>>> theirs

struct VideoDef {
  std::filesystem::path path;  ///< the ending selects the encoder: .mp4 .webm .mov .mkv .gif .webp .apng, or
                               ///< .png for animated PNG
  int width_px = 0, height_px = 0;
  FrameRate fps;
<<<<<<< ours
  bool alpha = false;  ///< .webm, .mov, .webp, .apng, .png keep it; others are refused
=======
  bool alpha =
      false;  ///< keeps the alpha channel; .webm, .mov, .webp, .apng, .png support it, others are refused
  StopTest stop = {};  ///< ends the wait for an encoder that accepts no frame or does not exit
>>>>>>> theirs
};

/// Checks a video before any frame is drawn. Throws UnavailableError, with the name of the package, if ffmpeg
/// or the required encoder is missing; std::invalid_argument with advice if the format does not support the
/// size or alpha.
void check_video(const VideoDef& def);
<<<<<<< ours
/// ffmpeg (or the program that OFFSTAGE_FFMPEG names) as a child process in its own process group, fed raw
/// frames, writing to NAME.part.EXT. Colour is BT.709 with sRGB's curve, alpha straight; the same frames give
/// the same bytes on any number of cores. GIF has a palette per frame, so that a long film needs no memory.
/// Throws as check_video does, and FileError if the file cannot be made.
std::unique_ptr<FrameSink> make_video_sink(const VideoDef& def);

/// Raw top-down frames on standard output: rgba bytes, or yuv4mpeg (4:4:4, BT.709, limited range) if `y4m`. A
/// closed pipe throws FileError. Throws std::invalid_argument for an impossible size or rate, and on a
/// terminal.
std::unique_ptr<FrameSink> make_pipe_sink(bool y4m, int width_px, int height_px, FrameRate fps);
=======
/// Writes a video with ffmpeg (or the program that OFFSTAGE_FFMPEG names). It runs as a child in its own
/// process group, gets raw frames and writes to an OutputFile. The file gets its final name when all frames
/// are found in it. Colour is BT.709 with sRGB's curve, alpha is straight. The same frames give the same
/// bytes on any number of cores. GIF has a palette per frame, so that memory does not grow with the length.
/// Throws as check_video does, and FileError if the file cannot be created.
std::unique_ptr<FrameSink> make_video_sink(const VideoDef& def);

/// Writes raw frames, rows from the top down, to standard output: rgba bytes, or yuv4mpeg (4:4:4, BT.709,
/// limited range) if `y4m`. A closed pipe throws FileError; a blocked pipe throws StoppedError after a
/// request to stop. Throws std::invalid_argument for an impossible size or rate, and on a terminal.
std::unique_ptr<FrameSink> make_pipe_sink(bool y4m, int width_px, int height_px, FrameRate fps,
                                          StopTest stop = {});
>>>>>>> theirs

/// File name endings of videos, with their dots.
std::vector<std::string> video_endings();
/// Whether a video with this ending keeps transparency; false for an unknown ending.
bool keeps_alpha(const std::string& ending);

/// The encoders used here that ffmpeg offers, for `doctor`; empty if there is no ffmpeg.
std::vector<std::string> available_encoders();

}  // namespace offstage::render
