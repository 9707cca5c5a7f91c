#pragma once
/// Finds the frames in a finished video file, by the index or the packets of its container. Private to
/// render.

#include <filesystem>
#include <string>

namespace offstage::render {

/// What shows that a film is not whole: its container is cut short or has not `frames` frames. Empty if it is
/// whole. GIF and WebP join equal frames, so their duration is compared with `seconds` instead. `name` has
/// the ending that decides the format. Throws FileError for a file that cannot be read.
std::string wrong_with_video(const std::filesystem::path& file, const std::filesystem::path& name, int frames,
                             double seconds);

}  // namespace offstage::render
