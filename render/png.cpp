#include "render/png.h"

#include <algorithm>
#include <array>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>

#include <libdeflate.h>

namespace offstage::render {
namespace {

constexpr int kLevel = 1;
constexpr std::string_view kSettingsKey("Settings\0", 9);

void append_number(std::vector<uint8_t>& out, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<uint8_t>(value >> shift));
}

/// Appends the checksum of a chunk, from its name at `start` to the end.
void close_chunk(std::vector<uint8_t>& out, std::size_t start) {
  append_number(out, libdeflate_crc32(0, out.data() + start, out.size() - start));
}

void append_chunk(std::vector<uint8_t>& out, std::string_view name, std::span<const uint8_t> data) {
  append_number(out, static_cast<uint32_t>(data.size()));
  const std::size_t start = out.size();
  out.insert(out.end(), name.begin(), name.end());
  out.insert(out.end(), data.begin(), data.end());
  close_chunk(out, start);
}

/// Returns the filtered rows. Each row is a byte for the filter type, and then the differences to the row
/// above.
std::vector<uint8_t> filtered(const PngPixels& pixels, std::size_t row_bytes) {
  constexpr uint8_t kUp = 2;
  const auto rows = static_cast<std::size_t>(pixels.height_px);
  std::vector<uint8_t> result((row_bytes + 1) * rows);
  const std::vector<uint8_t> nothing(row_bytes, 0);
  const uint8_t* above = nothing.data();
  const uint8_t* here = pixels.samples.data();
  uint8_t* out = result.data();
  for (std::size_t y = 0; y < rows; ++y) {
    *out++ = kUp;
    for (std::size_t i = 0; i < row_bytes; ++i) out[i] = static_cast<uint8_t>(here[i] - above[i]);
    above = here;
    here += row_bytes;
    out += row_bytes;
  }
  return result;
}

}  // namespace

std::vector<uint8_t> encode_png(const PngPixels& pixels) {
  const std::size_t row_bytes = static_cast<std::size_t>(std::max(pixels.width_px, 0)) *
                                static_cast<std::size_t>(pixels.channels * pixels.bits / 8);
  if (pixels.width_px <= 0 || pixels.height_px <= 0 ||
      pixels.samples.size() != row_bytes * static_cast<std::size_t>(pixels.height_px))
    throw std::invalid_argument("encode_png: the number of samples does not match the size of the image");

  std::vector<uint8_t> png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  std::vector<uint8_t> header;
  append_number(header, static_cast<uint32_t>(pixels.width_px));
  append_number(header, static_cast<uint32_t>(pixels.height_px));
  const auto kind = static_cast<uint8_t>(pixels.channels == 1 ? 0 : pixels.channels == 3 ? 2 : 6);
  // The last three values mean: deflate, the standard filters, not interlaced.
  header.insert(header.end(), {static_cast<uint8_t>(pixels.bits), kind, 0, 0, 0});
  append_chunk(png, "IHDR", header);

  if (!pixels.settings.empty()) {
    std::vector<uint8_t> text(kSettingsKey.begin(), kSettingsKey.end());
    text.insert(text.end(), pixels.settings.begin(), pixels.settings.end());
    append_chunk(png, "tEXt", text);
  }
  if (!pixels.comment.empty()) {
    // The keyword is followed by zeros that mean: not compressed, no language, no translated keyword.
    constexpr std::string_view kStart("Comment\0\0\0\0\0", 12);
    std::vector<uint8_t> text(kStart.begin(), kStart.end());
    text.insert(text.end(), pixels.comment.begin(), pixels.comment.end());
    append_chunk(png, "iTXt", text);
  }

  const std::vector<uint8_t> rows = filtered(pixels, row_bytes);
  const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
      libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  const std::size_t length_at = png.size(), name_at = length_at + 4, data_at = name_at + 4;
  png.resize(data_at + libdeflate_zlib_compress_bound(compressor.get(), rows.size()));
  const std::size_t size = libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(),
                                                    png.data() + data_at, png.size() - data_at);
  png.resize(data_at + size);
  for (std::size_t k = 0; k < 4; ++k) {
    png[length_at + k] = static_cast<uint8_t>(size >> (24 - 8 * k));
    png[name_at + k] = static_cast<uint8_t>("IDAT"[k]);
  }
  close_chunk(png, name_at);
  append_chunk(png, "IEND", {});
  return png;
}

std::string settings_in_png(std::span<const uint8_t> head) {
  constexpr std::size_t kHeader = 8 + 25;  // signature and IHDR
  if (head.size() < kHeader + 8) return {};
  std::size_t length = 0;
  for (std::size_t k = 0; k < 4; ++k) length = length << 8 | head[kHeader + k];
  const std::string_view rest(reinterpret_cast<const char*>(head.data()) + kHeader + 4,
                              head.size() - kHeader - 4);
  if (!rest.starts_with("tEXt") || length > rest.size() - 4 || length < kSettingsKey.size() ||
      !rest.substr(4).starts_with(kSettingsKey))
    return {};
  return std::string(rest.substr(4 + kSettingsKey.size(), length - kSettingsKey.size()));
}

}  // namespace offstage::render
