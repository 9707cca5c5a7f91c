#pragma once
/// Image files. Reading by stb_image, writing PNG by libdeflate.

#include <filesystem>
#include <span>
#include <vector>

#include "render/image.h"

namespace offstage::render {

/// Reads PNG, JPEG, TGA, BMP, GIF (its first frame), PSD or PNM, of up to 16384 pixels a side; 16 bits
/// become 8. Throws FileError.
Image read_image(const std::filesystem::path& path);
/// The same from memory (textures embedded in model files); `name` is used in messages.
Image decode_image(std::span<const uint8_t> bytes, const std::string& name);

/// PNG bytes: RGBA if the image is transparent, else RGB, whatever its pixels: so are all frames of a film.
std::vector<uint8_t> encode_png(const Image& image);

/// Writes through a temporary file in the same folder, flushed, then renamed: a file that is there is whole.
/// A device or named pipe is written to directly. Throws FileError with the system's reason.
void write_file_atomically(const std::filesystem::path& path, std::span<const uint8_t> bytes);
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace offstage::render
