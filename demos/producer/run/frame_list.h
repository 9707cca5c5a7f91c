#pragma once
/// Selects frames of a film: from a list such as "1-30,40,50-90x2", or one of several equal chunks.

#include <string>
#include <vector>

namespace offstage::producer {

/// Returns the frames in a list, in ascending order and each once. The items are separated by commas and have
/// the form k, a-b or a-bxstep. Negative numbers count from the end: -1 is the last frame. An empty text
/// means all frames. For an invalid text, or a frame outside of 1..count, throws std::invalid_argument with
/// the allowed values.
std::vector<int> parse_frames(const std::string& text, int count);

/// Divides the frames into n contiguous parts, whose sizes differ by at most one frame, and returns the i-th
/// part. `chunk` is "i/n", with i from 1. Throws std::invalid_argument for an invalid `chunk`.
std::vector<int> chunk_of(const std::vector<int>& frames, const std::string& chunk);

}  // namespace offstage::producer
