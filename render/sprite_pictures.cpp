#include "render/sprite_pictures.h"

#include <algorithm>
#include <array>
#include <bit>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/stage.h"
#include "render/tone_map.h"

namespace offstage::render {
namespace {

/// A picture in linear light with premultiplied alpha, rows from the top down.
struct LinearPicture {
  int width_px, height_px;
  std::vector<Vector4f> pixels;

  Vector4f& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
                  static_cast<std::size_t>(x)];
  }
};

LinearPicture cut(const Image& sheet, int left, int top, int width_px, int height_px) {
  std::array<float, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = srgb_decode(static_cast<float>(i) / 255);
  LinearPicture picture{width_px, height_px, {}};
  picture.pixels.reserve(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  for (int y = top; y < top + height_px; ++y) {
    for (int x = left; x < left + width_px; ++x) {
      const uint8_t* p = sheet.rgba.data() + 4 * (static_cast<std::ptrdiff_t>(y) * sheet.width_px + x);
      const float alpha = static_cast<float>(p[3]) / 255;
      picture.pixels.emplace_back(linear[p[0]] * alpha, linear[p[1]] * alpha, linear[p[2]] * alpha, alpha);
    }
  }
  return picture;
}

LinearPicture half_of(LinearPicture& fine) {
  LinearPicture half{std::max(fine.width_px / 2, 1), std::max(fine.height_px / 2, 1), {}};
  for (int y = 0; y < half.height_px; ++y) {
    for (int x = 0; x < half.width_px; ++x) {
      const int right = std::min(2 * x + 1, fine.width_px - 1),
                below = std::min(2 * y + 1, fine.height_px - 1);
      const int left = std::min(2 * x, right), above = std::min(2 * y, below);
      half.pixels.push_back(0.25f * (fine.at(left, above) + fine.at(right, above) + fine.at(left, below) +
                                     fine.at(right, below)));
    }
  }
  return half;
}

std::vector<uint8_t> encode(const LinearPicture& picture) {
  std::vector<uint8_t> bytes;
  bytes.reserve(picture.pixels.size() * 4);
  const auto byte = [](float x) { return static_cast<uint8_t>(std::clamp(x, 0.0f, 1.0f) * 255 + 0.5f); };
  for (const Vector4f& p : picture.pixels) {
    for (int c = 0; c < 3; ++c) bytes.push_back(byte(srgb_encode(p[c])));
    bytes.push_back(byte(p.w()));
  }
  return bytes;
}

}  // namespace

gl::Texture make_sprite_pictures(const Image& sheet, int columns, int rows) {
  if (columns < 1 || rows < 1 || columns > kMostSheetPictures / rows)
    throw std::invalid_argument("a sheet has 1 to " + std::to_string(kMostSheetPictures) + " pictures");
  const int width = sheet.width_px / columns, height = sheet.height_px / rows;
  if (width < 1 || height < 1)
    throw std::invalid_argument("a sheet of " + std::to_string(sheet.width_px) + "x" +
                                std::to_string(sheet.height_px) + " pixels cannot hold " +
                                std::to_string(columns) + "x" + std::to_string(rows) + " pictures");
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
  gl::Texture texture(name);
  const auto levels = static_cast<GLsizei>(std::bit_width(static_cast<unsigned>(std::max(width, height))));
  glTextureStorage3D(texture, levels, GL_SRGB8_ALPHA8, width, height, columns * rows);
  glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  for (int layer = 0; layer < columns * rows; ++layer) {
    LinearPicture level = cut(sheet, layer % columns * width, layer / columns * height, width, height);
    for (int k = 0; k < levels; ++k) {
      if (k > 0) level = half_of(level);
      glTextureSubImage3D(texture, k, 0, 0, layer, level.width_px, level.height_px, 1, GL_RGBA,
                          GL_UNSIGNED_BYTE, encode(level).data());
    }
  }
  return texture;
}

}  // namespace offstage::render
