#pragma once
/// Reads and writes image files. stb reads images and writes JPEG; libdeflate compresses PNG.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/image.h"

namespace offstage::render {

inline constexpr uint64_t kMaxImagePixels = uint64_t{1} << 28;  ///< limit for all images: 1 GiB of RGBA
inline constexpr uint64_t kMaxTexturePixels = uint64_t{1}
                                              << 26;  ///< limit for textures: 8192 x 8192, 256 MiB of RGBA

/// Reads PNG, JPEG, TGA, BMP, GIF (its first frame), PSD, PNM or (if built with libwebp) WebP, of up to 16384
/// pixels a side; 16-bit samples are converted to 8 bits. The declared size is checked before decoding.
/// Throws FileError.
Image read_image(const std::filesystem::path& path, uint64_t max_pixels = kMaxImagePixels);
/// Decodes an image in memory, such as a texture embedded in a model file. `name` is used in messages.
Image decode_image(std::span<const uint8_t> bytes, const std::string& name,
                   uint64_t max_pixels = kMaxImagePixels);

inline constexpr uint64_t kMaxLightPixels = uint64_t{1} << 25;  ///< limit for pictures of light: 8192 x 4096

/// A picture in linear light, with warnings about repaired values.
struct LightImage {
  HdrImage image;  ///< finite values, at least 0; alpha is 1
  std::vector<std::string> warnings;
};
/// Reads Radiance HDR, OpenEXR (RGB or Y), or a picture in sRGB that read_image() reads, with all of its
/// bits. Negative values and NaN become 0, and infinite values become the largest half float; both with a
/// warning. Throws FileError.
LightImage decode_light_image(std::span<const uint8_t> bytes, const std::string& name,
                              uint64_t max_pixels = kMaxLightPixels);

/// Encodes PNG: RGBA if the image is transparent, otherwise RGB. This does not depend on the pixels, so all
/// frames of a film are alike. `settings` identify the settings of the picture (ASCII, at most 256 bytes);
/// they are stored in the frames of a film.
std::vector<uint8_t> encode_png(const Image& image, const std::string& settings = {});

/// Start of the comment in which a JPEG stores its settings.
inline constexpr std::string_view kJpegSettings = "offstage settings ";
/// Encodes JPEG of quality 95 with colour at full resolution. `settings` are stored as by encode_png(). Alpha
/// is omitted.
std::vector<uint8_t> encode_jpeg(const Image& image, const std::string& settings = {});

/// Returns the settings stored in a PNG of offstage; empty for other files, and for a file that cannot be
/// read.
std::string png_settings(const std::filesystem::path& path);

/// Writes a file through an OutputFile, so that a file with this name is always complete. Devices, and named
/// pipes with a reader, are written directly. Throws FileError if this fails, or if `path` is a symbolic
/// link.
void write_file_atomically(const std::filesystem::path& path, std::span<const uint8_t> bytes);
void write_png(const std::filesystem::path& path, const Image& image, const std::string& settings = {});

}  // namespace offstage::render
