#pragma once
/// The files of single frames: PNG and JPEG of the displayed picture, OpenEXR of its linear light.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/sink.h"

namespace offstage::render {

enum class FrameFormat {
  png,
  jpeg,  ///< quality 95, colour at full resolution, no transparency
  exr,   ///< half floats, linear light times the exposure, without tone curve; premultiplied alpha
};

/// Returns the format that the ending of a file name selects: .png, .jpg, .jpeg or .exr. Empty for other
/// endings.
std::optional<FrameFormat> frame_format(const std::filesystem::path& path);
/// Returns the supported endings of frame files, with their dots.
const std::vector<std::string>& frame_endings();

/// Size and settings that are stored in the file of a frame.
struct FrameFile {
  int width_px = 0, height_px = 0;
  bool alpha = false;
  std::string settings;  ///< settings that the file was written with; empty if offstage did not write it as
                         ///< part of a film
};
/// Reads size and settings of a frame file without decoding its pixels. Empty if the file cannot be read, is
/// truncated, or does not have the format of its ending.
std::optional<FrameFile> inspect_frame(const std::filesystem::path& path);

/// Writes half floats of linear light: R, G, B, and A if the image is transparent. Throws FileError.
void write_exr(const std::filesystem::path& path, const HdrImage& image, const std::string& settings = {});
/// Does what inspect_frame() does, for EXR files.
std::optional<FrameFile> inspect_exr(const std::filesystem::path& path);

/// Creates a sink that writes one file per frame, in the format of the pattern's ending, with the settings.
/// Throws std::invalid_argument for another ending.
std::unique_ptr<FrameSink> make_frame_sink(const std::filesystem::path& pattern,
                                           const std::string& settings = {});

}  // namespace offstage::render
