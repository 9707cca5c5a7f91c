#pragma once
/// Image files. Reading by stb_image, writing PNG by libspng (level 1, filter UP: fast, and only a little
/// larger).

#include <filesystem>
#include <span>
#include <vector>

#include "render/image.h"

namespace offstage::render {

/// Reads PNG, JPEG, TGA, BMP, GIF, PSD or PNM. Throws FileError.
Image read_image(const std::filesystem::path& path);
/// The same from memory (textures embedded in model files); `name` is used in messages.
Image decode_image(std::span<const uint8_t> bytes, const std::string& name);

/// PNG bytes; RGB when every pixel is opaque, else RGBA.
std::vector<uint8_t> encode_png(const Image& image);

/// Writes through a temporary file in the same folder, flushed, then renamed: a file that is there is whole.
/// Throws FileError with the system's reason.
void write_file_atomically(const std::filesystem::path& path, std::span<const uint8_t> bytes);
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace offstage::render
