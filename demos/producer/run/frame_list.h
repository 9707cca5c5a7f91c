#pragma once
/// Selection of frames of a film: "1-30,40,50-90x2", and the n-th of several equal chunks.

#include <string>
#include <vector>

namespace offstage::producer {

/// Returns frames in ascending order, each once. Items are k, a-b or a-bxstep; negative numbers count from
/// the end (-1 is the last frame). Empty text: all. Throws std::invalid_argument with the allowed values for
/// invalid text or a frame outside of 1..count.
std::vector<int> parse_frames(const std::string& text, int count);

/// Returns the i-th of n contiguous parts, "i/n" with i from 1; their sizes differ by at most one frame.
/// Throws std::invalid_argument.
std::vector<int> chunk_of(const std::vector<int>& frames, const std::string& chunk);

}  // namespace offstage::producer
