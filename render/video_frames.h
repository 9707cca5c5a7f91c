#pragma once
/// Checks a finished video file: counts its frames by the index or the packets of the container. Private to
/// render.

#include <filesystem>
#include <string>

namespace offstage::render {

/// Returns why a film is not complete: the container is truncated, or does not have `frames` frames. Empty if
/// the film is complete. GIF and WebP merge equal frames, so their duration is compared with `seconds`
/// instead. The ending of `name` decides the format. Throws FileError for a file that cannot be read.
std::string wrong_with_video(const std::filesystem::path& file, const std::filesystem::path& name, int frames,
                             double seconds);

}  // namespace offstage::render
