#pragma once
/// Reads image files with stb_image, and writes PNG with libdeflate.

#include <filesystem>
#include <span>
#include <vector>

#include "render/image.h"

namespace offstage::render {

<<<<<<< ours
/// Reads PNG, JPEG, TGA, BMP, GIF (its first frame), PSD or PNM, of up to 16384 pixels a side; 16 bits
/// become 8. Throws FileError.
Image read_image(const std::filesystem::path& path);
/// The same from memory (textures embedded in model files); `name` is used in messages.
Image decode_image(std::span<const uint8_t> bytes, const std::string& name);

/// PNG bytes: RGBA if the image is transparent, else RGB, whatever its pixels: so are all frames of a film.
std::vector<uint8_t> encode_png(const Image& image);

/// Writes through a temporary file in the same folder, flushed, then renamed: a file that is there is whole.
/// A device or named pipe is written to directly. Throws FileError with the system's reason.
=======
inline constexpr uint64_t kMaxImagePixels = uint64_t{1} << 28;  ///< limit for any image: 1 GiB of RGBA
inline constexpr uint64_t kMaxTexturePixels = uint64_t{1}
                                              << 26;  ///< limit for a texture: 8192 x 8192, 256 MiB of RGBA

/// Reads PNG, JPEG, TGA, BMP, GIF (its first frame), PSD or PNM, up to 16384 pixels per side; 16 bits are
/// reduced to 8. The declared size is checked before decoding. Throws FileError.
Image read_image(const std::filesystem::path& path, uint64_t max_pixels = kMaxImagePixels);
/// Decodes an image from memory (textures embedded in model files); `name` is used in messages.
Image decode_image(std::span<const uint8_t> bytes, const std::string& name,
                   uint64_t max_pixels = kMaxImagePixels);

/// Encodes an image as PNG. It is RGBA if the image is flagged transparent, else RGB, regardless of its
/// pixels, so that all frames of a film have one format. `settings` identify the film's settings (ASCII, at
/// most 256 bytes); the frames of a film carry them.
std::vector<uint8_t> encode_png(const Image& image, const std::string& settings = {});

/// Reads the settings from a PNG written by this program; empty for other files and for unreadable ones.
std::string png_settings(const std::filesystem::path& path);

/// Writes through an OutputFile, so that the file is complete when it appears. A device, or a named pipe that
/// has a reader, is written to directly. Throws FileError with the system's reason, and for a symbolic link.
>>>>>>> theirs
void write_file_atomically(const std::filesystem::path& path, std::span<const uint8_t> bytes);
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace offstage::render
