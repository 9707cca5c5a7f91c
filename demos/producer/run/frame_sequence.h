#pragma once
/// Finds and checks the existing frames that match a pattern.

#include <filesystem>
#include <string>
#include <vector>

namespace offstage::producer {

struct SequenceFrame {
  int number = 0;
  std::filesystem::path path;
};

struct FrameSequence {
  /// Pattern of the file names, in which # stands for the number; see render::frame_path.
  std::filesystem::path pattern;
  std::vector<SequenceFrame> frames;  ///< frames in the order of their numbers; at least one
  int width_px = 0, height_px = 0;    ///< size of every frame
  bool may_be_transparent = false;    ///< whether a frame has an alpha channel
  int left_out = 0;                   ///< number of missing frames between the first and the last
};

/// Finds the frames of a pattern such as frames/####.png. A folder stands for the pattern ####.png in it. All
/// files must be complete PNG files of one size. Their numbers must be consecutive, unless gaps are allowed.
/// Throws OutputError for an invalid pattern, and FileError for an invalid or missing frame.
FrameSequence find_sequence(const std::string& pattern, bool allow_gaps);

}  // namespace offstage::producer
