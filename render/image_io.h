#pragma once
/// Image files. Reading by stb_image, writing PNG by libdeflate.

#include <filesystem>
#include <span>
#include <vector>

#include "render/image.h"

namespace offstage::render {

inline constexpr uint64_t kMaxImagePixels = uint64_t{1} << 28;  ///< of any image: 1 GiB of RGBA
inline constexpr uint64_t kMaxTexturePixels = uint64_t{1}
                                              << 26;  ///< of a texture: 8192 x 8192, 256 MiB of RGBA

/// Reads PNG, JPEG, TGA, BMP, GIF (its first frame), PSD or PNM, of up to 16384 pixels a side; 16 bits
/// become 8. The size that the file declares is checked before anything is decoded. Throws FileError.
Image read_image(const std::filesystem::path& path, uint64_t max_pixels = kMaxImagePixels);
/// The same from memory (textures embedded in model files); `name` is used in messages.
Image decode_image(std::span<const uint8_t> bytes, const std::string& name,
                   uint64_t max_pixels = kMaxImagePixels);

/// PNG bytes: RGBA if the image is transparent, else RGB, whatever its pixels: so are all frames of a film.
/// `settings` say what it was made with (ASCII, at most 256 bytes); a film's frames carry them.
std::vector<uint8_t> encode_png(const Image& image, const std::string& settings = {});

/// The settings that a PNG of ours carries; empty for others, and for a file that cannot be read.
std::string png_settings(const std::filesystem::path& path);

/// Writes through an OutputFile: a file that is there is whole. A device, or a named pipe that is being read,
/// is written to directly. Throws FileError with the system's reason, and for a symbolic link.
void write_file_atomically(const std::filesystem::path& path, std::span<const uint8_t> bytes);
void write_png(const std::filesystem::path& path, const Image& image, const std::string& settings = {});

}  // namespace offstage::render
