#pragma once
/// Frames that lie in a folder already, found by their pattern and checked before they are used.

#include <filesystem>
#include <string>
#include <vector>

namespace offstage::producer {

struct SequenceFrame {
  int number = 0;
  std::filesystem::path path;
};

struct FrameSequence {
  std::filesystem::path pattern;      ///< with #, as in render::frame_path
  std::vector<SequenceFrame> frames;  ///< by number; at least one
  int width_px = 0, height_px = 0;    ///< of every frame
  bool may_be_transparent = false;    ///< a frame has an alpha channel
  int left_out = 0;                   ///< numbers without a frame between the first and the last
};

/// Finds the frames of a pattern such as frames/####.png, or of a folder, which means ####.png in it. Every
/// file must be a whole PNG of one size, and numbers must follow each other unless gaps are allowed. Throws
/// OutputError for what is no pattern, and FileError that names the frame.
FrameSequence find_sequence(const std::string& pattern, bool allow_gaps);

}  // namespace offstage::producer
